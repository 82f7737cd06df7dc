"""The rays of all pixels of a picture, or of a region of it, by the exact trace."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from worker.optics.capture import Bench, object_rays, pixel_centres_mm
from worker.optics.trace import Rays

BAND_PX = 50_000
"""Pixels that are traced at once: few enough that they stay in the processor's cache (twice as fast as a whole frame)
and that a large frame needs little memory."""


def pixel_rays(bench: Bench, *, rows: int, cols: int, region: tuple[slice, slice] = (slice(None), slice(None))) -> Rays:
    """Return the rays that pixels see in the scene's space, each array (row, col, 3), mm; NaN where a pixel is dead.

    Parameters
    ----------
    rows, cols
        Of the whole picture; its window is that of the bench, whatever its size.
    region
        Rows and cols of it that are wanted.
    """
    points = pixel_centres_mm(bench, rows=rows, cols=cols)[region]
    height, width = points.shape[:2]
    position, direction = np.empty((height, width, 3)), np.empty((height, width, 3))
    step = max(1, BAND_PX // width)
    for start in range(0, height, step):
        band = slice(start, start + step)
        rays = object_rays(bench, points[band])
        position[band], direction[band] = rays.position, rays.direction
    return Rays(position, direction)


def dead_pixels(rays: Rays) -> NDArray[np.bool_]:
    """Return which pixels see nothing: an aperture stops their rays, or glass reflects them; shape (row, col)."""
    return np.isnan(rays.direction[..., 2])


def front_mm(bench: Bench) -> float:
    """Return the z from which the rays may start: surface 1 of the imaging lens, or the array without one."""
    return bench.mla_z_mm if bench.imaging_lens is None else 0.0
