"""Pictures made of an orthoscopic image on disk.

orthoscopic    the orthoscopic image of a pseudoscopic one, in bands
view           views and perspectives, written as PNG
channel_view   a channel of a view, such as its normals
refocus        refocused pictures, written as PNG
depth          depth maps of views
observe        what an observer sees, written as PNG or MP4
export         outputs made of masters on this machine
"""
