"""The pseudoscopic capture becomes the orthoscopic integral image.

Two things are wrong with an integral image as captured. Its depth is inside out (pseudoscopic), because it was recorded
from one side and will be looked at from the other: a half-turn of every elemental image puts that right (Athineos et
al. 2006). And its picture is upside down and left to right, because the imaging lens inverts: turning the whole sheet
by 180 degrees puts that right. The two turns cancel inside the cells, so both together reorder the lenses and leave
every cell as captured. All three are involutions, and the two steps commute.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from worker.integral.layout import CellLayout, Pixel, cells


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
        A new sheet of the same shape and dtype.
    """
    turned = np.empty_like(sheet, order="C")
    cells(turned, layout)[:] = cells(sheet, layout)[:, :, ::-1, ::-1]
    return turned


def turn_sheet(sheet: NDArray[Pixel]) -> NDArray[Pixel]:
    """Turn the whole sheet `(rows, cols, channel)` by 180 degrees in its plane; returns a view of the same memory.

    A print turned round on a table: the picture turns, depth stays.
    """
    return sheet[::-1, ::-1]


def orthoscopic(captured: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    """Return the orthoscopic integral image: `turn_sheet(half_turn_cells(captured))`.

    Computed in one step as what the two come to: the lenses in reverse order, `cells[::-1, ::-1]`, every cell as
    captured.

    Parameters
    ----------
    captured
        The pseudoscopic integral image `(rows, cols, channel)`, any dtype, its picture inverted by the imaging lens;
        stays as it is.
    layout
        How its pixels lie under the lenses.

    Returns
    -------
    NDArray
        A new, contiguous sheet of the same shape and dtype, ready for the display.
    """
    upright = np.empty_like(captured, order="C")
    cells(upright, layout)[:] = cells(captured, layout)[::-1, ::-1]
    return upright
