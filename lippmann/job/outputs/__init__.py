"""What a job may ask for beside its masters: one model for each kind of output, with its options.

output     what all kinds have: kind, name, file name
videos     moving pictures
observer   what an eye sees of the display, as clip and as pictures
clips      videos with a motion of their own: of the eye, of the focus
stereo     videos for two eyes
codecs     what may be chosen about a codec
depth      how deep what a view shows lies
pictures   still pictures of every frame
prints     pages for a printer
spoc       sheets for another display
datasets   folders and arrays for research on coding and depth
view_block views about the middle one, of all that a lens has
choice     all kinds as one field of a job, and their short spelling: `views.mp4`
"""
