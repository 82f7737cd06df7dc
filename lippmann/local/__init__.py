"""The work of a farm on this machine, without a farm: the public `IntegralImage`, and what the commands call.

image               `IntegralImage` of the Python API: open, views, refocus, depth, perspective, observe, save
capture             one frame of a scene rendered
preview             small pictures of a job, once or whenever its files change
design              what a job will give, without rendering
scene_init          the scene.toml of an own scene of POV-Ray written
model_init          the scene.toml of a glTF model written
splat_init          the scene.toml of Gaussian splats written
import_sheets       integral images from elsewhere imported as masters
import_views        views from elsewhere imported as masters: quilts and folders
import_bundle       imported images as a bundle for a job
orthoscopic         a pseudoscopic image on disk converted, in bands
view                views and perspectives written as PNG
refocus             refocused pictures written as PNG
depth               depth maps of views written
observe             what an observer sees, written as PNG or MP4
export              outputs made of masters on this machine
calibration_sheet   a calibration sheet written
compare             integral images on disk compared
codec_rates         rate and distortion of an integral video under several codecs
coding_study        such a study of a folder of frames
plot                axes and curves in one style
files/              masters, job files, bundles and lenses on disk
"""
