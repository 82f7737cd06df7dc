"""Epipolar slices: a line of lenses as the eye moves along it.

Bolles, Baker, Marimont, *Epipolar-plane image analysis*, International Journal of Computer Vision 1(1), 1987.

In a slice every point of the scene draws a line. With delta = s / (n f) lens pitches per view step, a point in front of
the display (s > 0) moves to lower lens numbers as u or v grows, one behind it to higher ones, and one in the array's
plane stands still.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout, Pixel
from lippmann.lightfield.sheet.interpolation import Light
from lippmann.lightfield.views.interpolate import views_in_col, views_in_row
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, view


def epi_of_row(ortho: NDArray[Pixel], layout: CellLayout, lens_row: int) -> NDArray[Pixel]:
    """Return the horizontal slice of a lens row, through the middle row of views.

    Parameters
    ----------
    ortho
        Orthoscopic sheet `(rows, cols, channel)`.
    layout
        How its pixels lie under the lenses.
    lens_row
        Which; hexagonal: the lenses of this row alone, wherever it is shifted to.

    Returns
    -------
    NDArray
        `(u, lens_col, channel)`, u growing downward.

    Raises
    ------
    LayoutError
        If there is no such lens row.
    """
    _check_lens("lens row", lens_row, layout.lens_rows)
    _, v = centre(layout)
    return np.stack([view(ortho, layout, u, v)[lens_row] for u in views_in_row(layout, v)])


def epi_of_col(ortho: NDArray[Light], layout: CellLayout, lens_col: int) -> NDArray[Light]:
    """Return the vertical slice of a lens column, through the middle column of views; see `epi_of_row`.

    Returns
    -------
    NDArray
        `(layout.square_size()[0], v, channel)`, v growing to the right. Hexagonal: the column of the views on square
        pixels, as lenses do not stand below each other.
    """
    _check_lens("lens column", lens_col, layout.square_size()[1])
    u, _ = centre(layout)
    lines = [as_square(view(ortho, layout, u, v), layout)[:, lens_col] for v in views_in_col(layout, u)]
    return np.stack(lines, axis=1)


def _check_lens(what: str, lens: int, count: int) -> None:
    if not 0 <= lens < count:
        raise LayoutError(f"expected a {what} from 0 to {count - 1}, got {lens}")
