"""Renderers; each engine has a folder."""
