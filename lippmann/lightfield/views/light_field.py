"""All views of a sheet in one array: `(v, u, row, col, channel)`.

v grows as the eye moves down, u as it moves to the right (see `views`). Row and col are those of the lenses, or, of a
hexagonal lattice put on square pixels, of `square_size`.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.views.square_pixels import as_square, nearest_as_square
from lippmann.lightfield.views.views import views_grid

Number = TypeVar("Number", bound=np.generic)


def light_field(image: IntegralImage) -> NDArray[np.floating[Any]]:
    """Return all views, `(cell_rows, cell_cols, lens_rows, lens_cols, channel)`; zero where a view does not exist.

    Parameters
    ----------
    image
        An orthoscopic image.

    Raises
    ------
    LayoutError
        If the image is pseudoscopic.
    """
    image.check_orthoscopic()
    return all_views(image.pixels, image.layout)


def all_views(sheet: NDArray[Number], layout: CellLayout) -> NDArray[Number]:
    """Return all views of the numbers of a sheet; see `light_field`.

    Parameters
    ----------
    sheet
        `(rows, cols, channel)` of an orthoscopic image, any numbers.
    layout
        The lenses over the sheet.
    """
    grid = views_grid(sheet, layout)
    views, lenses = (layout.cell_rows, layout.cell_cols), (layout.lens_rows, layout.lens_cols)
    return grid.reshape(views[0], lenses[0], views[1], lenses[1], -1).transpose(0, 2, 1, 3, 4)


def on_square_pixels(views: NDArray[np.floating[Any]], layout: CellLayout) -> NDArray[np.floating[Any]]:
    """Resample all views to square pixels at once, by `as_square`; on the square lattice return the views themselves.

    Parameters
    ----------
    views
        `(v, u, lens_row, lens_col, channel)`, floating.
    layout
        The lenses over the sheet.

    Returns
    -------
    NDArray
        `(v, u, *layout.square_size(), channel)`.
    """
    if not layout.interlocks:  # the lenses of a view stand on a square grid
        return views
    v, u, lens_rows, lens_cols, channels = views.shape
    stacked = views.transpose(2, 3, 0, 1, 4).reshape(lens_rows, lens_cols, -1)
    rows, cols = layout.square_size()
    return as_square(stacked, layout).reshape(rows, cols, v, u, channels).transpose(2, 3, 0, 1, 4)


def nearest_on_square_pixels(views: NDArray[Number], layout: CellLayout) -> NDArray[Number]:
    """Resample all views to square pixels from the nearest lenses; see `on_square_pixels` and `nearest_as_square`.

    Parameters
    ----------
    views
        All views, `(v, u, row, col, channel)`.
    layout
        The layout of the sheet.
    """
    if not layout.interlocks:
        return views
    return np.stack([[nearest_as_square(view, layout) for view in row] for row in views])


def square_places(layout: CellLayout) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where the square pixels of a view lie; (right, down) from the array's middle in pitches."""
    rows, cols = layout.square_size()
    right, down = np.meshgrid(np.arange(cols) - (cols - 1) / 2, np.arange(rows) - (rows - 1) / 2)
    return right, down


def eye_slopes(layout: CellLayout, *, gap_in_pitches: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the slopes at which the views are seen, to the right of each u and downward of each v.

    The tangent of the angle between the eye's direction and the display's axis: (u - middle) P / g, with the pixel P
    and the gap g. Down, pixels of a hexagonal lattice are sqrt(3) / 2 / `row_px` pitches high.

    Parameters
    ----------
    layout
        Of the sheet.
    gap_in_pitches
        g by the pitch of the lenses.
    """
    right = (np.arange(layout.cell_cols) - (layout.cell_cols - 1) / 2) / layout.px_per_lens
    down = (np.arange(layout.cell_rows) - (layout.cell_rows - 1) / 2) * layout.cell.row_pitch / layout.row_px
    return right / gap_in_pitches, down / gap_in_pitches
