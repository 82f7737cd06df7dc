"""Imaging lenses: prescriptions, files, ray-transfer matrices and the exact trace."""
