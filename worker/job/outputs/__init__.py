"""What a job may ask for beside its masters: one model for each kind of output, with its options.

output     what all kinds have: kind, name, file name
videos     moving pictures
pictures   still pictures of every frame
choice     all kinds as one field of a job, and their short spelling: `views.mp4`
"""
