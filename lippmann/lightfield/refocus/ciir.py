"""Computational integral imaging reconstruction (CIIR): every cell magnified to a depth, laid over each other.

Every cell is thrown back through its pinhole to depth s, which magnifies it by |s| / f and turns it round where s > 0;
what lies over each other is added, and divided by how much that was (Hong, Jang, Javidi, *Three-dimensional volumetric
object reconstruction using computational integral imaging*, Optics Express 12(3), 2004). Depths, their sign and f are
as in `refocus`.

A magnified pixel is a tent that ends at its neighbours' middles, which is linear interpolation inside the cell. It is
wider where the picture's pixels are larger than that, and where magnified cells do not meet, nearer to the display than
f: there it reaches the next cell's nearest pixel, so that depth 0 is the mean of every cell, and linear between lenses.

The picture has as many pixels as one likes, not one a lens: at s = -f, in the plane of the display's pixels, it is the
sheet itself, and `refocus` of a depth is about what CIIR gives at the lenses' centres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.refocus.shift_and_sum import checked_shifts
from lippmann.lightfield.refocus.weighted_sums import Taps, taps, weighted_sums
from lippmann.lightfield.sheet.cells import cells
from lippmann.lightfield.sheet.interpolation import Light

LEAST_STEP = 1e-9
"""The smallest shift of a point from view to view, pitches; a smaller one makes no difference."""


def ciir(image: IntegralImage, depth_mm: float, *, px_per_lens: int | None = None) -> NDArray[np.floating[Any]]:
    """Refocus an integral image to one depth by CIIR, `(row, col, channel)`.

    Parameters
    ----------
    image
        An orthoscopic image.
    depth_mm
        The depth s, mm in front of the display.
    px_per_lens
        As in `ciir_stack`.
    """
    return ciir_stack(image, (depth_mm,), px_per_lens=px_per_lens)[0]  # type: ignore[no-any-return]  # NumPy: a plane is Any


def ciir_stack(
    image: IntegralImage, depths_mm: Sequence[float], *, px_per_lens: int | None = None
) -> NDArray[np.floating[Any]]:
    """Refocus an integral image to several depths by CIIR; see the module.

    Parameters
    ----------
    image
        An orthoscopic image.
    depths_mm
        The depths s, mm in front of the display; at least one.
    px_per_lens
        The pixels a lens of the pictures; None for as many as the image has.

    Returns
    -------
    NDArray
        `(depth, *layout.square_size(px_per_lens), channel)`, in single precision or the sheet's, if higher. Dark where
        no magnified cell comes: in the dents of a hexagonal array's border.

    Raises
    ------
    LayoutError
        If the image is pseudoscopic, a depth is so far off that neighbouring views do not overlap, or there is
        not at least one pixel a lens.
    """
    image.check_orthoscopic()
    pixels, layout = image.pixels, image.layout
    px = layout.px_per_lens if px_per_lens is None else px_per_lens
    if px < 1:
        raise LayoutError(f"expected at least one pixel a lens, got {px}")
    steps = [checked_shifts(layout, depth_mm, focal_mm=image.focal_length_mm) for depth_mm in depths_mm]
    if not layout.interlocks:  # rows and columns are magnified one after the other
        down = [_axis_taps(layout.lens_rows, layout.px_per_lens, step, px=px).shares() for step, _ in steps]
        across = [_axis_taps(layout.lens_cols, layout.px_per_lens, step, px=px).shares() for _, step in steps]
        return weighted_sums(pixels, down, across)
    stack = _rows_alike(pixels, layout, 0, steps, px=px)
    if layout.lens_rows > 1:
        stack += _rows_alike(pixels, layout, 1, steps, px=px)
    light, counted = stack[..., :-1], stack[..., -1:]
    return np.where(counted > 0, light / np.where(counted > 0, counted, 1), 0)


def _axis_taps(lenses: int, cell_px: int, step: float, *, px: int) -> Taps:
    """Return the taps along one axis of a square sheet."""
    return _magnified_taps(
        made=_places(lenses * px, px), first=-(lenses - 1) / 2, apart=1.0, lenses=lenses, cell_px=cell_px, step=step,
        width=_width(px, cell_px, step),
    )  # fmt: skip


def _rows_alike(
    pixels: NDArray[Light], layout: CellLayout, first_row: int, steps: Sequence[tuple[float, float]], *, px: int
) -> NDArray[np.floating[Any]]:
    """Return what every other hexagonal lens row gives, from one on, and as the last channel how much that is."""
    mask, n = layout.mask, layout.px_per_lens
    high, wide = layout.square_size(px)
    own = cells(pixels, layout)[first_row::2].astype(np.result_type(pixels.dtype, np.float32))
    counted = np.broadcast_to(mask[..., np.newaxis], (*own.shape[:-1], 1)).astype(own.dtype)
    sheet = np.concatenate((own, counted), axis=-1).transpose(0, 2, 1, 3, 4)
    rows = len(own)
    down, across = [], []
    for step_down, step_across in steps:
        width = _width(px, n, step_across)
        down.append(_magnified_taps(
            made=_places(high, px), first=(first_row - (layout.lens_rows - 1) / 2) * layout.cell.row_pitch,
            apart=layout.cell.row_period * layout.cell.row_pitch,
            lenses=rows, cell_px=layout.cell_rows, step=step_down, width=width,
        ))  # fmt: skip
        first = layout.lenses.row_middle_pitches(first_row) - (layout.lens_cols - 1) / 2
        across.append(_magnified_taps(
            made=_places(wide, px), first=first, apart=1.0,
            lenses=layout.lens_cols, cell_px=n, step=step_across, width=width,
        ))  # fmt: skip
    return weighted_sums(sheet.reshape(rows * layout.cell_rows, layout.lens_cols * n, -1), down, across)


def _places(pixels: int, px: int) -> NDArray[np.float64]:
    """Return the middles of a picture's pixels along an axis, pitches from the array's middle."""
    return (np.arange(pixels) - (pixels - 1) / 2) / px


def _width(px: int, cell_px: int, step: float) -> float:
    """Return how far a magnified pixel reaches at least, pitches: a picture's pixel, or to the next cell's nearest."""
    return max(1 / px, 1 - abs(step) * (cell_px - 1))


def _magnified_taps(
    *, made: NDArray[np.float64], first: float, apart: float, lenses: int, cell_px: int, step: float, width: float
) -> Taps:
    """Return the taps of a picture's pixels at places along an axis among those of a row of magnified cells.

    Lens k stands at first + k apart, and its pixel j is seen at first + k apart - (j - (cell_px - 1) / 2) step; all in
    pitches. Lens k's pixel j is k cell_px + j of the sheet.
    """
    step = math.copysign(max(abs(step), LEAST_STEP), step)
    width = max(width, abs(step))
    reach = abs(step) * (cell_px - 1) / 2 + width
    low = np.ceil((made - reach - first) / apart).astype(np.intp)
    lens = low[:, np.newaxis] + np.arange(math.floor(2 * reach / apart) + 1)
    centre = first + apart * lens[..., np.newaxis]
    pixel = np.arange(cell_px)
    away = centre - (pixel - (cell_px - 1) / 2) * step - made[:, np.newaxis, np.newaxis]
    weight = np.maximum(1 - np.abs(away) / width, 0)
    weight *= ((lens >= 0) & (lens < lenses))[..., np.newaxis]
    # Less than a rounding error is nothing.
    weight[weight < 1e-9] = 0
    number = np.broadcast_to(np.arange(made.size)[:, np.newaxis, np.newaxis], weight.shape)
    return taps(number, lens[..., np.newaxis] * cell_px + pixel, weight, pixels=made.size)
