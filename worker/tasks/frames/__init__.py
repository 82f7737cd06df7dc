"""A frame: its tiles rendered, then assembled.

render        a tile into the store
render_cache  a tile that was rendered before
picture       the room in which an engine renders for an attempt
channels      depth and other channels of a tile, rendered with the colours or before them
depth_pass    the depth of the pixels of a tile, by a second picture
imported      the image of a frame that is not rendered, from the bundle of the job
assemble      tiles to integral image, orthoscopic image, views and thumbnail
masters       the masters that assemble stores, in memory or read again from disk
"""
