"""Interpolate views between the views of a row, linearly."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.sheet.interpolation import between, neighbours, working
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view


def views_in_row(layout: CellLayout, v: int) -> range:
    """Return u of the views that exist in a row of views; on the square lattice all of them exist.

    Parameters
    ----------
    layout
        The lenses over the sheet.
    v
        The row of views.

    Raises
    ------
    LayoutError
        If there is no such row, or a corner of the hexagon leaves no view in it.
    """
    found = layout.views_in_row(v)
    if not found:
        raise LayoutError(f"expected a row of views of {layout}, from 0 to {layout.cell_rows - 1}, got {v}")
    return found


def views_in_col(layout: CellLayout, u: int) -> range:
    """Return v of the views that exist in a column of views.

    Parameters
    ----------
    layout
        The lenses over the sheet.
    u
        The column of views.

    Raises
    ------
    LayoutError
        If there is no such column.
    """
    found = layout.views_in_col(u)
    if not found:
        raise LayoutError(f"expected a column of views of {layout}, from 0 to {layout.cell_cols - 1}, got {u}")
    return found


def spread_views(image: IntegralImage, v: int, count: int) -> Iterator[NDArray[np.floating[Any]]]:
    """Yield views of one row from the leftmost eye to the rightmost, on square pixels, evenly spread.

    Parameters
    ----------
    image
        An orthoscopic image.
    v
        The row of views.
    count
        The number of views. The number of existing views gives exactly these, and one gives the middle; others are
        interpolated between the two nearest, in which a point that moves by more than a lens appears twice.

    Yields
    ------
    NDArray
        `(*layout.square_size(), channel)` in the dtype of the image.

    Raises
    ------
    LayoutError
        If there is no such row of views, or the image is pseudoscopic.
    """
    image.check_orthoscopic()
    pixels, layout = image.pixels, image.layout
    there = views_in_row(layout, v)
    for first, second, weight in zip(*neighbours(spread(there, count), there[0], there[-1]), strict=True):
        left, right = (working(view(pixels, layout, int(u), v)) for u in (first, second))
        yield as_square(between(left, right, np.asarray(weight)).astype(pixels.dtype), layout)


def spread(there: range, count: int) -> NDArray[np.float64]:
    """Return places evenly spread from the first view of a row to the last; a single one is in the middle.

    Parameters
    ----------
    there
        The views that exist in the row.
    count
        The number of places.

    Examples
    --------
    >>> spread(range(4), 7)
    array([0. , 0.5, 1. , 1.5, 2. , 2.5, 3. ])
    """
    if count == 1:
        return np.array([(there[0] + there[-1]) / 2])
    return np.linspace(there[0], there[-1], count)
