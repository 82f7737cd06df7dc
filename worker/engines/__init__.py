"""Renderers; each engine has a folder and stands behind one protocol.

choose     the engine of a job
code       the digest of our code, for the render cache
engine     the protocol: a region of a frame in, light and channels out
povray     POV-Ray: the text of a scene, the command line, progress, diagnosis
mitsuba    Mitsuba: meshes, glTF and splats
"""
