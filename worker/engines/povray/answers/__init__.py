"""The answers of POV-Ray while it renders, and what they mean.

messages    messages and statistics, unwrapped
progress    its progress, read from its messages
forecast    the moment at which it needs its core no longer
diagnosis   what its answers mean and what we do
hints       hints for the author of a scene
places      places in the files of a scene, for messages about ours
"""
