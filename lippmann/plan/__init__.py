"""Plan a job: its tasks, its design and its printed pages. Everything here is pure, without input or output.

artifact_names  the names of artifacts
artifact_store  the interface of an artifact store
sampling        the size of a frame in pixels, and tiles along lens edges
render_cache    the keys of tiles by their definition, and the names of cached ones
imported        the lenses of an imported picture, and the rig of its masters
cost            the cost of a task, and the number of tiles of a frame
tasks           every task, its stage and its needs
design/         the designer: the properties of a job before anything is rendered
printing/       pages for a printer: prints and calibration sheets
"""
