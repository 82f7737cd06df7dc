"""The commands on integral images on disk.

import_sheets  import
orthoscopic    orthoscopic
views          view, refocus
observe        observe
depth          depth
export         export
compare        compare
coding_study   coding-study
"""
