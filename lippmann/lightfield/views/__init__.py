"""Views of an orthoscopic image.

views           sub-aperture views (one pixel per lens), the grid of all views, their serpentine order
light_field     all views as one array
square_pixels   views of a hexagonal lattice resampled to square pixels
interpolate     views between views
epi             epipolar-plane images
mosaic          pictures of one size put together into one
atlas           views in one picture for a graphics card
perspective     what an eye at a place sees, one pixel per lens
"""
