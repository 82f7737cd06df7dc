"""The work of a farm on this machine, without a farm: the public `IntegralImage`, and what the commands call.

image               `IntegralImage` of the Python API: open, views, refocus, depth, perspective, observe, save
capture             one frame of a scene rendered
preview             small pictures of a job, once or whenever its files change
design              what a job will give, without rendering
calibration_sheet   a calibration sheet written
pictures/           pictures made of an orthoscopic image: views, refocus, depth, observer, outputs
importing/          integral images and views from elsewhere
scenes/             the scene.toml of scenes that other programs made
studies/            integral images compared, and the rates of codecs
files/              masters, job files, bundles and lenses on disk
"""
