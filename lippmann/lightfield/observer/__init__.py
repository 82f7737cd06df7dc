"""The virtual observer: what an eye sees of a print or panel under its lenses."""
