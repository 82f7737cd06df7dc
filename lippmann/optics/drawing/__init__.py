"""Drawings of the optical bench, to scale, as SVG."""
