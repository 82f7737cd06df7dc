"""Drawings of the optical bench, to scale, as SVG.

diagram   the whole drawing: its panels, labels and legend
bench     the elements of the bench in a panel
rays      the rays in a drawing
svg       SVG text: elements, panels, labels, scale bars
"""
