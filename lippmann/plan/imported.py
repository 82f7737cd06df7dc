"""From what is said of an integral image from elsewhere to its lenses in pixels, and to a rig for its masters."""

from __future__ import annotations

from dataclasses import replace

from lippmann.errors import LayoutError
from lippmann.job.imported_sheets import SheetGeometry
from lippmann.job.rig import LensArray, Rig
from lippmann.lightfield.calibrate.whole_lenses import (
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
        If they do not lie on it.
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
    placed = said if geometry.offset_px is not None else in_middle(said, size)
    if not are_whole(placed, size):
        room = lenses_in_middle(said, size)
        raise LayoutError(
            f"expected {placed} to lie on the picture of {size[0]} x {size[1]} px; it has room for"
            f" {room.lens_rows} x {room.lens_cols}, or as many with a pitch of {fitting_pitch_px(said, size):.2f} px"
        )
    return placed


def fitting_pitch_px(grid: LensGrid, size: tuple[int, ...]) -> float:
    """Return the largest pitch at which as many lenses lie on a picture, with the lattice's own proportions."""
    high = (grid.lens_rows + grid.cell.overhang) * grid.row_px / grid.pitch_px
    _, wide = grid.layout().lenses.extent
    return min(size[0] / high, size[1] / wide)


def upright_first(grid: LensGrid, *, inverted: bool) -> LensGrid:
    """Return the grid without the lens row that would come out on top with its lenses shifted.

    A rig's sheets begin with a row that is not shifted; a picture need not.
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


def foreign_rig(geometry: SheetGeometry, grid: LensGrid) -> Rig:
    """Return the rig that the masters of such a picture name: direct pickup, since nothing is left to be turned."""
    array = LensArray(
        lattice=grid.lattice,
        count=(grid.lens_rows, grid.lens_cols),
        pitch_mm=geometry.lens_pitch_mm,
        focal_length_mm=geometry.lens_focal_mm(geometry.lens_pitch_mm),
        offset_mm=0.0,
    )
    layout = grid.layout(geometry.px_per_lens)
    return Rig(imaging_lens=None, lens_array=array, px_per_lens=layout.px_per_lens)
