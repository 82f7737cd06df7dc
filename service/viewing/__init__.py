"""Views of a frame on demand.

viewable_frame   a frame whose views can be requested
frames           finds such a frame, and describes its views
queue            makes pictures in turn, a few at once, so that no viewer stalls others
process_pool     the processes that make the pictures
process_handle   one of them, as the service sees it
picture_process  one of them, as it runs
sheet_cache      keeps the orthoscopic sheets in its memory that users view
depth            depth maps, and the depth to which to focus at a place
render           makes the pictures: views, perspective, refocusing, observer, atlas, conversions
"""
