"""Refocusing: shift-and-sum, CIIR, depth-focused views and all-in-focus pictures."""
