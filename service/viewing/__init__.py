"""Views of a frame on demand.

frames       finds a frame that can be viewed, and describes its views
sheet_cache  keeps the orthoscopic sheets in memory that users view
queue        makes pictures in turn, a few at once, so that no viewer stalls others
render       makes the pictures: views, perspective, refocusing, observer, atlas
"""
