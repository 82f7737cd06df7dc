"""Depth maps: ground truth, estimates from the pictures, and their errors."""
