"""Interpolate light at any place under a lens, between the pixels of its own cell only.

A pixel is of the lens that its centre lies under: on a border, of the lens to the right or below it, and where the
border of a hexagon slants, above it, as `to_device` has it. Light is interpolated linearly between the four pixels
about a place; those of other cells, and those beyond the picture's edge, have no weight, so a place nearer to the
border than the outermost pixels' centres takes what these have. In a corner where none of the four is the lens's own,
the place moves toward the lens's axis until one is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lightfield.sheet.interpolation import SNAP, Light
from lippmann.lightfield.sheet.lens_grid import LensGrid

NEARER = 0.8
"""The factor by which a place in a corner moves toward the axis at each step."""


@dataclass(frozen=True)
class Places:
    """Places under lenses: arrays of one shape, or that broadcast to one."""

    lens_row: NDArray[np.intp]
    lens_col: NDArray[np.intp]
    down: NDArray[np.float64]
    """The distance below the axis of the lens, px along the rotated lattice."""
    right: NDArray[np.float64]

    def flat(self) -> Places:
        """Return the same places in a row."""
        lens_row, lens_col, down, right = np.broadcast_arrays(self.lens_row, self.lens_col, self.down, self.right)
        return Places(lens_row.ravel(), lens_col.ravel(), down.ravel(), right.ravel())

    def some(self, which: NDArray[np.bool_], *, nearer: float = 1.0) -> Places:
        """Return some of the places, moved toward the axes of their lenses.

        Parameters
        ----------
        which
            A mask of the places, bool.
        nearer
            The factor by which the distance from the axis is multiplied.
        """
        return Places(self.lens_row[which], self.lens_col[which], self.down[which] * nearer, self.right[which] * nearer)


def light_under(picture: NDArray[Light], grid: LensGrid, places: Places) -> NDArray[np.floating[Any]]:
    """Interpolate the light at places under the lenses of a picture; see the module.

    Parameters
    ----------
    picture
        `(rows, cols, channel)`, linear light.
    grid
        Where its lenses are.
    places
        Of any shape; the centre of every lens that they are under lies on the picture.

    Returns
    -------
    NDArray
        `(*shape, channel)`, in single precision or the picture's, if higher.
    """
    shape = np.broadcast_shapes(*(part.shape for part in (places.lens_row, places.lens_col, places.down, places.right)))
    left = places.flat()
    light, lit = _interpolated(picture, grid, left)
    where = np.arange(lit.size)
    while not lit.all():
        left, where = left.some(~lit, nearer=NEARER), where[~lit]
        light[where], lit = _interpolated(picture, grid, left)
    return light.reshape(*shape, picture.shape[2])


def picture_places(grid: LensGrid, places: Places) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the positions of places in the picture, (down, right), px from its top left corner.

    Parameters
    ----------
    grid
        The lenses over the picture.
    places
        The places under the lenses.
    """
    axis_down, axis_right = _axes(grid, places)
    down, right = axis_down + places.down, axis_right + places.right
    cos, sin = _turn(grid)
    return grid.offset_px[0] + right * sin + down * cos, grid.offset_px[1] + right * cos - down * sin


def _interpolated(
    picture: NDArray[Light], grid: LensGrid, places: Places
) -> tuple[NDArray[np.floating[Any]], NDArray[np.bool_]]:
    """Return the light at places in a row, and at which there is a pixel of the lens's own."""
    axis_down, axis_right = _axes(grid, places)
    # Whole at the centres of pixels.
    row, col = (np.round((at - 0.5) * SNAP) / SNAP for at in picture_places(grid, places))
    first_row, first_col = np.floor(row).astype(np.intp), np.floor(col).astype(np.intp)
    light = np.zeros((row.size, picture.shape[2]), dtype=np.result_type(picture.dtype, np.float32))
    weights = np.zeros(row.size)
    for below, beside in product((0, 1), repeat=2):
        px_row, px_col = first_row + below, first_col + beside
        weight = (1 - np.abs(row - px_row)) * (1 - np.abs(col - px_col))
        down, right = _in_lattice(grid, px_row, px_col)
        weight *= grid.cell.owns((right - axis_right) / grid.pitch_px, (down - axis_down) / grid.row_px)
        weight *= (px_row >= 0) & (px_row < picture.shape[0]) & (px_col >= 0) & (px_col < picture.shape[1])
        # Taken where they weigh, so that what is no number in one cell stays there.
        (has,) = np.nonzero(weight)
        light[has] += picture[px_row[has], px_col[has]] * weight[has, np.newaxis].astype(light.dtype)
        weights += weight
    lit = weights > 0
    light[lit] /= weights[lit, np.newaxis].astype(light.dtype)
    return light, lit


def _axes(grid: LensGrid, places: Places) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the axes of the lenses that places are under, (down, right) px from lens (0, 0) along the lattice."""
    shifts = np.array([grid.shift_pitches(0), grid.shift_pitches(1)])
    return places.lens_row.astype(np.float64) * grid.row_px, (
        places.lens_col + shifts[places.lens_row % 2]
    ) * grid.pitch_px


def _in_lattice(
    grid: LensGrid, row: NDArray[np.intp], col: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the (down, right) px from lens (0, 0) along the lattice of the centres of pixels."""
    cos, sin = _turn(grid)
    below = row.astype(np.float64) + (0.5 - grid.offset_px[0])
    beside = col.astype(np.float64) + (0.5 - grid.offset_px[1])
    return below * cos - beside * sin, below * sin + beside * cos


def _turn(grid: LensGrid) -> tuple[float, float]:
    """Return the (cos, sin) of the lattice's turn."""
    return math.cos(math.radians(grid.turn_deg)), math.sin(math.radians(grid.turn_deg))
