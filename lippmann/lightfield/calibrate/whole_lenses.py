"""The largest block of lenses that lie completely on a picture."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lightfield.sheet.lens_grid import LensGrid

BEYOND_PX = 0.5
"""The distance by which a whole lens may reach beyond the picture, px."""

STILL_PX = 1e-9
"""A step that leads no further than that along a side of the picture."""

EXACT = 1e-9
"""Lenses: what fits but for rounding fits."""

ENDS = 400
"""Lens rows at the top and at the bottom among which a block may begin and end: turned pictures lose that many."""


def whole_lenses(one: LensGrid, size: tuple[int, ...]) -> LensGrid:
    """Return the largest block of whole lenses on a picture; the first row of a hexagonal one is not shifted.

    Parameters
    ----------
    one
        Any lens of the lattice, its count of no matter.
    size
        (rows, cols) of the picture, px.

    Raises
    ------
    LayoutError
        If there is no whole lens.
    """
    cell = one.cell
    starts = [replace(one, offset_px=lens_place(one, row, cell.shift(row))) for row in range(cell.row_period)]
    blocks = [_block(replace(start, first_row_shifted=False), size) for start in starts]
    largest = max((block for block in blocks if block is not None), key=_count, default=None)
    if largest is None:
        raise LayoutError(f"expected a whole lens of {one.pitch_px:g} px on {size[1]} x {size[0]} px, got none")
    return largest


def lenses_from_first(first: LensGrid, size: tuple[int, ...]) -> LensGrid:
    """Return the largest block of whole lenses that begins with a given lens.

    Parameters
    ----------
    first
        A grid whose lens (0, 0) is the first one.
    size
        (rows, cols) of the picture, px.

    Raises
    ------
    LayoutError
        If that lens is not whole.
    """
    block = _block(first, size, begins_there=True)
    if block is None:
        down, right = first.offset_px
        raise LayoutError(
            f"expected the first lens, of {first.pitch_px:g} px, whole on {size[1]} x {size[0]} px, got its centre at"
            f" ({right:g}, {down:g}) px"
        )
    return block


def lenses_in_middle(one: LensGrid, size: tuple[int, ...]) -> LensGrid:
    """Return as many whole lenses as a picture has room for, in its middle.

    Parameters
    ----------
    one
        A grid of the lattice; its place and its number of lenses do not matter.
    size
        (rows, cols) of the picture, px.

    Raises
    ------
    LayoutError
        If there is no whole lens.
    """
    near = whole_lenses(replace(one, offset_px=(size[0] / 2, size[1] / 2)), size)
    # What fits where it happens to stand is one lens more or less than what fits in the middle.
    counts = product((near.lens_rows + 1, near.lens_rows), (near.lens_cols + 1, near.lens_cols))
    standing = (in_middle(replace(near, lens_rows=rows, lens_cols=cols), size) for rows, cols in counts)
    return max((grid for grid in standing if are_whole(grid, size)), key=_count, default=near)


def in_middle(grid: LensGrid, size: tuple[int, ...]) -> LensGrid:
    """Move a grid so that the middle of its block is the middle of the picture.

    Parameters
    ----------
    grid
        The lenses.
    size
        (rows, cols) of the picture, px.
    """
    sideways = (grid.lens_cols - 1) / 2
    if grid.lens_rows > 1:
        sideways += grid.shift_pitches(1) / 2
    middle = lens_place(replace(grid, offset_px=(0.0, 0.0)), (grid.lens_rows - 1) / 2, sideways)
    return replace(grid, offset_px=(size[0] / 2 - middle[0], size[1] / 2 - middle[1]))


def are_whole(grid: LensGrid, size: tuple[float, ...]) -> bool:
    """Return whether all lenses of a grid lie on a picture, to half a pixel.

    Parameters
    ----------
    grid
        The lenses.
    size
        (rows, cols) of the picture, px.
    """
    outermost = sorted({0, min(1, grid.lens_rows - 1), max(0, grid.lens_rows - 2), grid.lens_rows - 1})
    shifts = np.array([grid.shift_pitches(row) for row in outermost])
    low, high = _cols(grid, np.array(outermost), shifts, size)
    return bool((low <= 0).all() and (high >= grid.lens_cols - 1).all())


def lens_place(grid: LensGrid, lens_row: float, pitches: float) -> tuple[float, float]:
    """Return the place (down, right) in the picture, px, of a point of the lattice.

    Parameters
    ----------
    grid
        The lenses.
    lens_row
        Lens rows below lens (0, 0).
    pitches
        Pitches to the right of lens (0, 0).
    """
    turn = math.radians(grid.turn_deg)
    down, right = lens_row * grid.row_px, pitches * grid.pitch_px
    return (
        grid.offset_px[0] + right * math.sin(turn) + down * math.cos(turn),
        grid.offset_px[1] + right * math.cos(turn) - down * math.sin(turn),
    )


def _count(grid: LensGrid) -> int:
    return grid.lens_rows * grid.lens_cols


def _block(first: LensGrid, size: tuple[int, ...], *, begins_there: bool = False) -> LensGrid | None:
    """Return the largest block of whole lenses whose first row is one like that of `first`; or begins with it."""
    reach = math.ceil(math.hypot(size[0], size[1]) / min(first.row_px, first.pitch_px)) + 2
    rows = np.arange(0 if begins_there else -reach, reach)
    low, high = _spans(first, rows, size)
    row_low, row_high = _cols(first, rows, np.zeros(1), size)
    if begins_there:
        low, row_low = np.where(low <= 0, 0, high + 1), np.where(row_low <= 0, 0, row_high + 1)
    (there,) = np.nonzero(row_low <= row_high)
    alike = rows[there] % first.cell.row_period == 0
    begins, ends = there[alike & ((rows[there] == 0) | (not begins_there))][:ENDS], there[-ENDS:]
    if not begins.size:
        return None
    # A picture has no dents: between two rows that hold a span, every row holds it.
    left, right = np.maximum.outer(low[begins], low[ends]), np.minimum.outer(high[begins], high[ends])
    # A block of one row has no shifted row to share its columns with.
    one_row = np.equal.outer(begins, ends)
    left = np.where(one_row, row_low[begins, np.newaxis], left)
    right = np.where(one_row, row_high[begins, np.newaxis], right)
    high_lenses, wide_lenses = (ends - begins[:, np.newaxis] + 1).clip(0), (right - left + 1).clip(0)
    area = high_lenses * wide_lenses
    begin, end = np.unravel_index(np.argmax(area), area.shape)
    return replace(
        first,
        lens_rows=int(high_lenses[begin, end]),
        lens_cols=int(wide_lenses[begin, end]),
        offset_px=lens_place(first, float(rows[begins[begin]]), float(left[begin, end])),
    )


def _spans(first: LensGrid, rows: NDArray[np.intp], size: tuple[int, ...]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the first and the last whole lens of lens rows, counted from lens (0, 0).

    Hexagonal: as if every row were shifted and not, since the rows of a block are both.
    """
    shifts = [np.array(first.shift_pitches(row)) for row in range(first.cell.row_period)]
    spans = [_cols(first, rows, shift, size) for shift in shifts]
    return np.max([low for low, _ in spans], axis=0), np.min([high for _, high in spans], axis=0)


def _cols(
    grid: LensGrid, rows: NDArray[np.intp], shifts: NDArray[np.float64], size: tuple[float, ...]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the first and the last lens of rows, shifted by so many pitches, that lies on the picture whole."""
    turn = math.radians(grid.turn_deg)
    low, high = np.full(rows.shape, -np.inf), np.full(rows.shape, np.inf)
    place = (
        grid.offset_px[0] + rows * grid.row_px * math.cos(turn),
        grid.offset_px[1] - rows * grid.row_px * math.sin(turn),
    )
    for at, along, reach_px, side in zip(place, (math.sin(turn), math.cos(turn)), _reach_px(grid), size, strict=False):
        step = along * grid.pitch_px
        room = (reach_px - BEYOND_PX - at, side - reach_px + BEYOND_PX - at)
        if abs(step) < STILL_PX:
            on = (room[0] <= 0) & (room[1] >= 0)
            low, high = np.where(on, low, np.inf), np.where(on, high, -np.inf)
            continue
        ends = room if step > 0 else room[::-1]
        low, high = np.maximum(low, ends[0] / step - shifts), np.minimum(high, ends[1] / step - shifts)
    low, high = np.nan_to_num(np.ceil(low - EXACT), posinf=1, neginf=0), np.nan_to_num(np.floor(high + EXACT), neginf=0)
    return low.astype(np.intp), high.astype(np.intp)


def _reach_px(grid: LensGrid) -> tuple[float, float]:
    """Return how far a lens reaches from its centre in the picture, (down, right) px."""
    corners = [(right * grid.pitch_px, down * grid.row_px) for right, down in grid.cell.corners]
    cos, sin = math.cos(math.radians(grid.turn_deg)), math.sin(math.radians(grid.turn_deg))
    return max(abs(x * sin + y * cos) for x, y in corners), max(abs(x * cos - y * sin) for x, y in corners)
