"""Convert a pseudoscopic capture to the orthoscopic integral image.

Two things are wrong with an integral image as captured. Its depth is inside out (pseudoscopic), because it was recorded
from one side and will be looked at from the other: a half-turn of every elemental image puts that right (Athineos et
al. 2006). And its picture is upside down and left to right, because the imaging lens inverts: turning the whole sheet
by 180 degrees puts that right. The two turns cancel inside the cells, so both together reorder the lenses and leave
every cell as captured. All three are involutions, and the two steps commute. Without an imaging lens (direct pickup)
nothing inverts the picture, and the half-turn of the cells is all.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout, Pixel, check_sheet
from lippmann.lightfield.sheet.cells import cells, put_pixels, run_px, runs


def half_turn_cells(sheet: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    """Turn every elemental image by 180 degrees in its place: the sign of every depth flips.

    Parameters
    ----------
    sheet
        `(rows, cols, channel)`, any dtype; stays as it is.
    layout
        How its pixels lie under the lenses.

    Returns
    -------
    NDArray
        A new sheet of the same shape, dtype and layout; zero where there is no lens.
    """
    if not layout.interlocks:  # the cells are the sheet's memory with other axes
        turned = np.empty_like(sheet, order="C")
        put_pixels(cells(turned, layout), cells(sheet, layout)[:, :, ::-1, ::-1])
        return turned
    return _hexagons_turned_in_place(sheet, layout)


def turn_sheet(sheet: NDArray[Pixel]) -> NDArray[Pixel]:
    """Turn the whole sheet `(rows, cols, channel)` by 180 degrees in its plane; returns a view of the same memory.

    A print turned round on a table: the picture turns, depth stays. Its layout is then `layout.turned()`.
    """
    return sheet[::-1, ::-1]


def orthoscopic(captured: NDArray[Pixel], layout: CellLayout, *, inverted: bool = True) -> NDArray[Pixel]:
    """Convert a capture: `half_turn_cells`, and `turn_sheet` where an imaging lens inverted it.

    Both together are computed in one step as what they come to: the lenses in reverse order, `cells[::-1, ::-1]`, every
    cell as captured.

    Parameters
    ----------
    captured
        The pseudoscopic integral image `(rows, cols, channel)`, any dtype; stays as it is.
    layout
        How its pixels lie under the lenses.
    inverted
        Whether an imaging lens turned the picture upside down; false for direct pickup.

    Returns
    -------
    NDArray
        A new, contiguous sheet of the same shape and dtype, ready for the display, zero where there is no lens. Its
        layout is `orthoscopic_layout(layout, inverted=inverted)`.
    """
    if not inverted:
        return half_turn_cells(captured, layout)
    if not layout.interlocks:  # the cells are the sheet's memory with other axes
        upright = np.empty_like(captured, order="C")
        cells(upright, layout)[:] = cells(captured, layout)[::-1, ::-1]
        return upright
    return _hexagons_in_reverse(captured, layout)


def orthoscopic_layout(captured: CellLayout, *, inverted: bool = True) -> CellLayout:
    """Return the layout of the orthoscopic sheet; of an odd number of hexagonal lens rows, the others are shifted.

    Parameters
    ----------
    captured
        The layout of the capture.
    inverted
        True if an imaging lens turned the picture upside down.
    """
    return captured.turned() if inverted else captured


def _hexagons_turned_in_place(sheet: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    check_sheet(sheet, layout)
    turned = np.zeros(sheet.shape, dtype=sheet.dtype)
    for run in runs(layout):
        # The hexagon is its own mirror image, so the row that comes here has the same cols.
        source = replace(run, cell_row=layout.cell_rows - 1 - run.cell_row)
        put_pixels(run_px(turned, layout, run), run_px(sheet, layout, source)[:, :, ::-1])
    return turned


def _hexagons_in_reverse(sheet: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    check_sheet(sheet, layout)
    upright, after = np.zeros(sheet.shape, dtype=sheet.dtype), layout.turned()
    for run in runs(after):
        # The last lens row of these comes first: for an even number of rows, it is one of the others.
        source = replace(run, first_lens_row=(layout.lens_rows - 1 - run.first_lens_row) % 2)
        run_px(upright, after, run)[:] = run_px(sheet, layout, source)[::-1, ::-1]
    return upright
