"""Depth-focused views: not one pixel of every lens but a patch of them, so that one depth joins up without a seam.

A plane at depth s moves over the lenses by delta = s / (n f) pitches from one view to the next (`refocus`), n pixels a
lens. So under one lens a patch of 1 / |delta| pixels shows just as much of the plane as lies between that lens and the
next, and patches side by side, turned round for s > 0, are a picture of the plane: of several pixels a lens where a
view has one. Other depths come out broken, the more so the further they are off. It is the viewer of Athineos et al.
2006, section 4.1: pixel information "under each microlens or adjacent microlenses, resulting in 2-D views for
different viewing angles or depths".

The patch stands about one direction, a view (u, v) or between views; the picture lies where the view of that direction
does. Light is interpolated inside the cell, never across. The patch of |s| = f is the whole cell, so nearer to the
display it does not exist; beyond n f, where it is less than a pixel, the picture is the view. On the hexagonal lattice
patches are hexagons, shown on square pixels.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.cell import ON_THE_BORDER
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.refocus.shift_and_sum import checked_shifts
from lippmann.lightfield.sheet.cell_sampling import Places, light_under
from lippmann.lightfield.sheet.interpolation import Light
from lippmann.lightfield.sheet.lens_grid import layout_grid
from lippmann.lightfield.views.square_pixels import as_square

ROWS_AT_ONCE = 64
"""The rows of the picture that are computed together, so that the extra memory stays at some ten MB."""


def depth_focused_view(
    image: IntegralImage,
    depth_mm: float,
    *,
    direction: tuple[float, float] | None = None,
    px_per_lens: int | None = None,
) -> NDArray[np.floating[Any]]:
    """Return the view that joins up at one depth; see the module.

    Parameters
    ----------
    image
        An orthoscopic image.
    depth_mm
        The depth s, mm in front of the display.
    direction
        The view (u, v) about which the patch stands, which may lie between views; None for the middle of all views.
    px_per_lens
        The pixels a lens of the picture; None for the whole number nearest to the patch's. With one, the picture is
        the view itself.

    Returns
    -------
    NDArray
        `(*layout.square_size(px_per_lens), channel)`, in single precision or the sheet's, if higher. Dark where there
        is no lens, in the dents of a hexagonal array's border.

    Raises
    ------
    LayoutError
        If the image is pseudoscopic, there is no such view or not at least one pixel a lens, the patch does not
        fit in the cell, or the depth is so far off that neighbouring views do not overlap.
    """
    image.check_orthoscopic()
    pixels, layout = image.pixels, image.layout
    middle = (layout.cell_cols - 1) / 2, (layout.cell_rows - 1) / 2
    u, v = middle if direction is None else direction
    right, down = middle[0] - u, middle[1] - v
    steps = _checked_steps(layout, depth_mm, image.focal_length_mm, (u, v), _off_axis(layout, down, right))
    px = max(1, round(1 / abs(steps[1]))) if px_per_lens is None else px_per_lens
    if px < 1:
        raise LayoutError(f"expected at least one pixel a lens, got {px}")
    if px == 1:
        return as_square(_plain(pixels, layout, down, right), layout)
    rows, cols = layout.square_size(px)
    picture = np.zeros((rows, cols, pixels.shape[2]), dtype=np.result_type(pixels.dtype, np.float32))
    grid, lenses = layout_grid(layout), layout.lenses
    below, beside = ((np.arange(length) - (length - 1) / 2) / px for length in (rows, cols))
    for start in range(0, rows, ROWS_AT_ONCE):
        part = slice(start, start + ROWS_AT_ONCE)
        lens = lenses.nearest(beside[np.newaxis], below[part, np.newaxis])
        lit = lenses.has(lens.lens_row, lens.lens_col)
        places = Places(lens.lens_row, lens.lens_col, down - lens.down / steps[0], right - lens.right / steps[1])
        picture[part][lit] = light_under(pixels, grid, places.flat().some(lit.ravel()))
    return picture


def _plain(pixels: NDArray[Light], layout: CellLayout, down: float, right: float) -> NDArray[np.floating[Any]]:
    """Return the view from one direction, px from the lenses' axes, `(lens_rows, lens_cols, channel)`."""
    rows, cols = np.arange(layout.lens_rows)[:, np.newaxis], np.arange(layout.lens_cols)
    return light_under(pixels, layout_grid(layout), Places(rows, cols, np.array(down), np.array(right)))


def _off_axis(layout: CellLayout, down: float, right: float) -> float:
    """Return how far a place under a lens is from its axis: 1 on the cell's border, in any direction."""
    x, y = np.array(right / layout.px_per_lens), np.array(down / layout.row_px)
    return float(layout.cell.border_distance(x, y))


def _checked_steps(
    layout: CellLayout, depth_mm: float, focal_mm: float, direction: tuple[float, float], off_axis: float
) -> tuple[float, float]:
    u, v = direction
    last_u, last_v = layout.cell_cols - 1, layout.cell_rows - 1
    if not (0 <= u <= last_u and 0 <= v <= last_v and off_axis < 1):
        raise LayoutError(f"expected a view under a lens, from (0, 0) to ({last_u}, {last_v}), got ({u:g}, {v:g})")
    steps = checked_shifts(layout, depth_mm, focal_mm=focal_mm)
    # The patch is the cell, made smaller by f / |s|; one that is a pixel or less is the view's.
    least_mm = min(focal_mm / (1 - off_axis), focal_mm * layout.px_per_lens)
    if abs(depth_mm) < least_mm * (1 - ON_THE_BORDER):
        raise LayoutError(
            f"expected a depth at least {least_mm:.4g} mm from the display for view ({u:g}, {v:g}), where the patch"
            f" under every lens stays inside its cell, got {depth_mm:g} mm"
        )
    return steps
