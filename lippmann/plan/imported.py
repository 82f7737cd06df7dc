"""The lenses of an imported integral image in pixels, and the rig of its masters."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import replace

from lippmann.errors import LayoutError
from lippmann.job.optics.rig import MIN_PX_PER_LENS, LensArray, Rig
from lippmann.job.scenes.imported_sheets import SheetGeometry
from lippmann.lightfield.calibrate.whole_lenses import (
    BEYOND_PX,
    are_whole,
    in_middle,
    lens_place,
    lenses_from_first,
    lenses_in_middle,
)
from lippmann.lightfield.sheet.lens_grid import LensGrid
from lippmann.lightfield.sheet.orthoscopic import orthoscopic_layout


def lens_grid(geometry: SheetGeometry, size: tuple[int, ...]) -> LensGrid:
    """Return the lenses over a picture of `size` (rows, cols), px.

    Raises
    ------
    LayoutError
        If they do not lie on the picture.
    """
    rows, cols = geometry.count or (1, 1)
    said = LensGrid(
        rows,
        cols,
        pitch_px=geometry.pitch_px,
        offset_px=geometry.offset_px or (0.0, 0.0),
        lattice=geometry.lattice,
        first_row_shifted=geometry.first_row_shifted and rows > 1,
        row_pitch_px=geometry.row_pitch_px,
        turn_deg=geometry.rotation_deg,
    )
    if geometry.count is None:
        if geometry.offset_px is None:
            return lenses_in_middle(said, size)
        return lenses_from_first(said, size)
    place = in_middle if geometry.offset_px is None else _array_place
    placed = place(said, size)
    if not are_whole(placed, size):
        raise LayoutError(
            f"expected {placed} to lie on the picture of {size[1]} x {size[0]} px; {_advice(said, size, place)}"
        )
    return placed


Placement = Callable[[LensGrid, tuple[int, ...]], LensGrid]


def _array_place(grid: LensGrid, size: tuple[int, ...]) -> LensGrid:
    return grid


def _advice(asked: LensGrid, size: tuple[int, ...], place: Placement) -> str:
    """Return suggestions that fit; every suggestion keeps all other fields as they are.

    Raises
    ------
    LayoutError
        If not even the first lens is complete at its offset.
    """
    if place is in_middle:
        room, where = lenses_in_middle(asked, size), "it"
    else:
        room, where = lenses_from_first(asked, size), "from this first lens it"
    fits = [f"{where} has room for {room.lens_cols} x {room.lens_rows}"]
    pitch_px = fitting_pitch_px(asked, size, place)
    if pitch_px is not None:
        fits.append(f"as many with a pitch of {pitch_px:.2f} px")
    if place is not in_middle and are_whole(in_middle(asked, size), size):
        fits.append("as many in the middle of the picture, without an offset")
    return ", or ".join(fits)


def fitting_pitch_px(asked: LensGrid, size: tuple[int, ...], place: Placement = in_middle) -> float | None:
    """Return the largest pitch at which the same number of lenses lies on a picture, in whole hundredths of a pixel.

    Parameters
    ----------
    asked
        The lenses that do not lie on the picture. Their rotation, their row pitch if it is given, and with `place`
        their offset are kept.
    size
        (rows, cols) of the picture, px.
    place
        Returns the lenses of a pitch at their place on the picture.

    Returns
    -------
    float | None
        The pitch, px. None if the lenses of no smaller pitch fit.
    """
    strict = (size[0] - 2 * BEYOND_PX, size[1] - 2 * BEYOND_PX)

    def fits(hundredths: int) -> bool:
        grid = place(replace(asked, pitch_px=hundredths / 100), size)
        down, right = grid.offset_px
        # Nothing may reach beyond the picture, not even the half pixel that a whole lens may.
        return are_whole(replace(grid, offset_px=(down - BEYOND_PX, right - BEYOND_PX)), strict)

    smallest, largest = 100 * MIN_PX_PER_LENS, math.floor(100 * asked.pitch_px)
    if largest < smallest or not fits(smallest):
        return None
    # The largest hundredth that fits, by bisection: a smaller pitch fits wherever a larger one does.
    return (bisect_left(range(smallest, largest + 1), True, key=lambda one: not fits(one)) + smallest - 1) / 100


def upright_first(grid: LensGrid, *, inverted: bool) -> LensGrid:
    """Return the grid without its top lens row if that would be a shifted row.

    The images of a rig begin with a row that is not shifted; those of a picture need not.
    """
    if not orthoscopic_layout(grid.layout(), inverted=inverted).first_row_shifted:
        return grid
    if inverted:  # the last row comes out on top
        return replace(grid, lens_rows=grid.lens_rows - 1)
    return replace(
        grid,
        lens_rows=grid.lens_rows - 1,
        offset_px=lens_place(grid, 1, grid.shift_pitches(1)),
        first_row_shifted=False,
    )


def imported_rig(geometry: SheetGeometry, grid: LensGrid) -> Rig:
    """Return the rig for the masters of an imported picture: direct pickup, because no conversion is left to do."""
    array = LensArray(
        lattice=grid.lattice,
        count=(grid.lens_rows, grid.lens_cols),
        pitch_mm=geometry.lens_pitch_mm,
        focal_length_mm=geometry.lens_focal_length_mm(geometry.lens_pitch_mm),
        offset_mm=0.0,
    )
    layout = grid.layout(geometry.px_per_lens)
    return Rig(imaging_lens=None, lens_array=array, px_per_lens=layout.px_per_lens)
