"""Views of a frame on demand."""
