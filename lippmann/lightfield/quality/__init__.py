"""Quality metrics of integral images, and of codecs."""
