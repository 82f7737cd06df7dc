"""Views of an integral image: sub-aperture views, epipolar images, perspectives and atlases."""
