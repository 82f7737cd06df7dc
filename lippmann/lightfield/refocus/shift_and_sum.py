"""Refocus by shift-and-sum: the views are shifted by the disparity of a depth, and averaged.

Depths s are the **display's**: millimetres from its array, positive in front of it, on a display whose array stands one
focal length f in front of its pixels (pinholes at gap f). A point at s from the capture's array lies at s + f there
(docs/optics.md, Depth).

In the paraxial approximation a point at s moves over the lenses by delta = s / (n f) pitches from one view to the next,
where n is the number of pixels per lens: for s > 0 to the left as the eye moves to the right, and up as it moves down.
To refocus, every view is shifted back by this motion, and all views are averaged; the centre of the views does not
move. Shifts between lenses are interpolated linearly, in linear light. Pixels that would come from beyond the array do
not count.

On the hexagonal lattice the views are first resampled to square pixels (`as_square`), one pitch apart both ways.
`ciir` computes the same picture by another method, with more pixels.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.cell import ON_THE_BORDER
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.refocus.weighted_sums import Taps, taps, weighted_sums
from lippmann.lightfield.sheet.interpolation import SNAP, Light
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view, view_numbers


def shifts(layout: CellLayout, depth_mm: float, *, focal_mm: float) -> tuple[float, float]:
    """Return the shift of a point from one view to the next, (down, across), in lens pitches.

    A positive shift is against the motion of the eye. The two differ a little on the hexagonal lattice,
    where pixels are not quite square.

    Parameters
    ----------
    layout
        The lenses over the sheet.
    depth_mm
        The depth s of the point, mm in front of the display.
    focal_mm
        The focal length of the lenses, mm.

    Raises
    ------
    LayoutError
        If the depth is not finite, or the focal length is not positive.

    Examples
    --------
    >>> down, across = shifts(CellLayout(90, 90, 8), 40.0, focal_mm=3.3)
    >>> round(across, 3)
    1.515
    """
    if not (math.isfinite(depth_mm) and math.isfinite(focal_mm) and focal_mm > 0):
        raise LayoutError(f"expected a depth and a positive focal length in mm, got {depth_mm} and {focal_mm}")
    return depth_mm / focal_mm * layout.cell.row_pitch / layout.row_px, depth_mm / focal_mm / layout.px_per_lens


def refocus(image: IntegralImage, depth_mm: float) -> NDArray[np.floating[Any]]:
    """Refocus an integral image to one depth; see the module.

    Parameters
    ----------
    image
        An orthoscopic image.
    depth_mm
        The depth s, mm in front of the display.

    Returns
    -------
    NDArray
        `(*layout.square_size(), channel)`, in single precision or the sheet's, if higher. At depth 0 the mean of all
        views.

    Raises
    ------
    LayoutError
        As in `focal_stack`.
    """
    return focal_stack(image, (depth_mm,))[0]  # type: ignore[no-any-return]  # NumPy: a plane is Any


def focal_stack(image: IntegralImage, depths_mm: Sequence[float]) -> NDArray[np.floating[Any]]:
    """Refocus an integral image to several depths.

    The sheet is read once for all depths, a band of lens rows at a time. On the hexagonal lattice memory beside it and
    the result is two to three times the sheet in single precision.

    Parameters
    ----------
    image
        An orthoscopic image.
    depths_mm
        The depths s, mm in front of the display; at least one.

    Returns
    -------
    NDArray
        `(depth, *layout.square_size(), channel)`, as in `refocus`.

    Raises
    ------
    LayoutError
        If the image is pseudoscopic, or a depth is so far off that neighbouring views do not overlap.
    """
    image.check_orthoscopic()
    pixels, layout = image.pixels, image.layout
    steps = [checked_shifts(layout, depth_mm, focal_mm=image.focal_length_mm) for depth_mm in depths_mm]
    rows, cols = layout.square_size()
    down = [_view_taps(rows, layout.cell_rows, step) for step, _ in steps]
    across = [_view_taps(cols, layout.cell_cols, step) for _, step in steps]
    if not layout.interlocks:  # every pixel of a cell is a view, and the sheet itself can be summed
        return weighted_sums(pixels, [one.shares() for one in down], [one.shares() for one in across])
    stack = weighted_sums(_views_with_counts(pixels, layout), down, across)
    # Neighbouring views overlap, so every pixel is counted at least once.
    return stack[..., :-1] / stack[..., -1:]


def checked_shifts(layout: CellLayout, depth_mm: float, *, focal_mm: float) -> tuple[float, float]:
    """Return `shifts` at a depth at which neighbouring views overlap.

    Parameters
    ----------
    layout, depth_mm, focal_mm
        As in `shifts`.

    Raises
    ------
    LayoutError
        If they do not overlap, naming the largest depth at which they do; or as in `shifts`.
    """
    found = shifts(layout, depth_mm, focal_mm=focal_mm)
    most_mm = layout.overlap_depth(focal_mm)
    if abs(depth_mm) > most_mm * (1 + ON_THE_BORDER):
        raise LayoutError(
            f"expected a depth at which neighbouring views of {layout} overlap, at most {most_mm:g} mm from the"
            f" display, got {depth_mm:g} mm"
        )
    return found


def _view_taps(lenses: int, views: int, step: float) -> Taps:
    """Return, along one axis of the sheet, the pixels that make each lens of a picture: of every view one or two.

    Of lens i, view u's pixel is i views + views - 1 - u.
    """
    number = np.arange(views)
    shift = np.round(-step * (number - (views - 1) / 2) * SNAP) / SNAP
    whole = np.floor(shift).astype(np.intp)
    weight = np.broadcast_to(shift - whole, (lenses, views))
    lens = np.arange(lenses)[:, np.newaxis]
    near = lens + whole
    far = near + (weight > 0)
    there = (near >= 0) & (far < lenses)
    return taps(
        np.broadcast_to(lens, (2, lenses, views)),
        np.stack((near, far)) * views + (views - 1 - number),
        np.stack((1 - weight, weight)) * there,
        pixels=lenses,
    )


def _views_with_counts(pixels: NDArray[Light], layout: CellLayout) -> NDArray[np.floating[Any]]:
    """Return the views on square pixels as a sheet of square cells, and as its last channel which of them exist."""
    rows, cols = layout.square_size()
    light = np.result_type(pixels.dtype, np.float32)
    cells = np.zeros((rows, layout.cell_rows, cols, layout.cell_cols, pixels.shape[2] + 1), dtype=light)
    for u, v in view_numbers(layout):
        place = cells[:, layout.cell_rows - 1 - v, :, layout.cell_cols - 1 - u]
        place[..., :-1] = as_square(view(pixels, layout, u, v).astype(light), layout)
        place[..., -1] = 1
    return cells.reshape(rows * layout.cell_rows, cols * layout.cell_cols, pixels.shape[2] + 1)
