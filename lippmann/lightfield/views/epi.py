"""Epipolar-plane images (EPI): a line of lenses as the eye moves along it.

Bolles, Baker, Marimont, *Epipolar-plane image analysis*, International Journal of Computer Vision 1(1), 1987.

In a slice every point of the scene draws a line. With delta = s / (n f) lens pitches per view step, a point in front of
the display (s > 0) moves to lower lens numbers as u or v grows, one behind it to higher ones, and one in the array's
plane stands still.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.views.interpolate import views_in_col, views_in_row
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, view


def epi_of_row(image: IntegralImage, lens_row: int) -> NDArray[np.floating[Any]]:
    """Return the horizontal slice of a lens row, through the middle row of views.

    Parameters
    ----------
    image
        An orthoscopic image.
    lens_row
        The number of the lens row; on the hexagonal lattice the slice has the lenses of this row alone, unshifted.

    Returns
    -------
    NDArray
        `(u, lens_col, channel)`, u growing downward, in the dtype of the image.

    Raises
    ------
    LayoutError
        If there is no such lens row, or the image is pseudoscopic.
    """
    image.check_orthoscopic()
    layout = image.layout
    _check_lens("lens row", lens_row, layout.lens_rows)
    _, v = centre(layout)
    return np.stack([view(image.pixels, layout, u, v)[lens_row] for u in views_in_row(layout, v)])


def epi_of_col(image: IntegralImage, lens_col: int) -> NDArray[np.floating[Any]]:
    """Return the vertical slice of a lens column, through the middle column of views.

    Parameters
    ----------
    image
        An orthoscopic image.
    lens_col
        The number of the lens column; on the hexagonal lattice a column of the views on square pixels, as its lenses
        do not stand below each other.

    Returns
    -------
    NDArray
        `(layout.square_size()[0], v, channel)`, v growing to the right, in the dtype of the image.

    Raises
    ------
    LayoutError
        If there is no such lens column, or the image is pseudoscopic.
    """
    image.check_orthoscopic()
    layout = image.layout
    _check_lens("lens column", lens_col, layout.square_size()[1])
    u, _ = centre(layout)
    lines = [as_square(view(image.pixels, layout, u, v), layout)[:, lens_col] for v in views_in_col(layout, u)]
    return np.stack(lines, axis=1)


def _check_lens(what: str, lens: int, count: int) -> None:
    if not 0 <= lens < count:
        raise LayoutError(f"expected a {what} from 0 to {count - 1}, got {lens}")
