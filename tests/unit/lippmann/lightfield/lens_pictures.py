"""Pictures of lenses whose place is known, by plain geometry: a place is under the lens whose centre is nearest."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.lightfield.sheet.lens_grid import LensGrid
from tests.unit.lippmann.lightfield.sheets import ROW_PITCH

FINE = 3
"""Places a pixel, in each direction."""


def white_image(
    grid: LensGrid, size: tuple[int, int], *, look: str = "vignetted", noise: float = 0.02, seed: int = 0
) -> NDArray[np.float64]:
    """Return what a sensor of `size` (rows, cols) sees of white light through the endless lattice, `(rows, cols, 1)`.

    Each lens is dark at its rim (`vignetted`), a bright `spot`, or evenly bright between dark `bordered` walls; the
    whole is darker toward its corners, and noisy.
    """
    right, down = _from_lens(grid, size)
    away = np.hypot(right, down)
    if look == "vignetted":
        light = np.clip(1 - 1.5 * away**2, 0, 1)
    elif look == "spot":
        light = np.exp(-(away**2) / (2 * 0.22**2))
    else:
        to_side = np.maximum(np.abs(right), np.abs(down))
        if grid.lattice == "hexagonal":
            to_side = np.maximum(np.abs(right), np.abs(right) / 2 + np.abs(down) * ROW_PITCH)
        # Walls that fade over a pixel, so that no place depends on how finely it is drawn.
        light = np.clip((0.5 - to_side) * grid.pitch_px, 0.2, 1.0)
    pixels = light.reshape(size[0], FINE, size[1], FINE).mean(axis=(1, 3))
    row, col = (np.arange(side) / side - 0.5 for side in size)
    pixels *= 1 - 0.4 * (row[:, np.newaxis] ** 2 + col**2)
    noisy: NDArray[np.float64] = pixels + np.random.default_rng(seed).normal(0, noise, size)
    return noisy[..., np.newaxis]


def off_lattice_px(grid: LensGrid, found: LensGrid) -> float:
    """Return how far the first lens of one grid is from the nearest lens of the other, px."""
    down, right = (b - a for a, b in zip(grid.offset_px, found.offset_px, strict=True))
    turn = math.radians(grid.turn_deg)
    along = right * math.cos(turn) + down * math.sin(turn)
    across = down * math.cos(turn) - right * math.sin(turn)
    distances = []
    for row in range(math.floor(across / grid.row_px), math.floor(across / grid.row_px) + 2):
        shift = grid.shift_pitches(row) * grid.pitch_px
        beside = (along - shift) - round((along - shift) / grid.pitch_px) * grid.pitch_px
        distances.append(math.hypot(beside, across - row * grid.row_px))
    return min(distances)


def _from_lens(grid: LensGrid, size: tuple[int, int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return fine places from the nearest lens's centre, (right, down) in pitches."""
    down, right = ((np.arange(side * FINE) + 0.5) / FINE - at for side, at in zip(size, grid.offset_px, strict=True))
    turn = math.radians(grid.turn_deg)
    x = right * math.cos(turn) + down[:, np.newaxis] * math.sin(turn)
    y = down[:, np.newaxis] * math.cos(turn) - right * math.sin(turn)
    best_x, best_y = np.full(x.shape, np.inf), np.full(x.shape, np.inf)
    for step in (0, 1) if grid.lattice == "hexagonal" else (0.5,):
        row = np.floor(y / grid.row_px + step)
        along = x / grid.pitch_px - np.where(row % 2 == 0, 0.0, grid.shift_pitches(1))
        beside, below = along - np.round(along), (y - row * grid.row_px) / grid.pitch_px
        nearer = np.hypot(beside, below) < np.hypot(best_x, best_y)
        best_x, best_y = np.where(nearer, beside, best_x), np.where(nearer, below, best_y)
    return best_x, best_y
