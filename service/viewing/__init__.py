"""Views of a frame on demand.

frames       finds a frame that can be viewed, and describes its views
sheet_cache  keeps the orthoscopic sheets in memory that users view
render       makes the pictures: views, perspective, refocusing, observer, atlas
"""
