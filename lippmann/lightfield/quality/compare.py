"""PSNR and SSIM of two integral images, for example before and after a codec: of the sheet and of every view.

Pictures are compared as coding research does it, as 8-bit sRGB codes, so the peak is 255:

    PSNR = 10 log10(255^2 / MSE) dB,    Y = 0.2126 R + 0.7152 G + 0.0722 B    (ITU-R BT.709-6, item 3.2)

with Y of the codes and not rounded. The RGB PSNR is that of the mean over the three channels' squared errors. SSIM is
of Y, by Wang, Bovik, Sheikh and Simoncelli, "Image quality assessment: from error visibility to structural similarity",
IEEE Trans. Image Processing 13 (2004), 600-612: eq. (13) under a Gaussian window of 11 x 11 px with a standard
deviation of 1.5 px, at every place where the whole window lies inside the picture, and the mean of these, eq. (17). The
picture is not made smaller first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout, check_sheet
from lippmann.lightfield.quality.luminance import WEIGHTS
from lippmann.lightfield.views.views import view_numbers, view_of_grid, views_grid

Codes = NDArray[np.uint8]
Values = NDArray[np.float64]

PEAK = 255.0

WINDOW_PX = 11
WINDOW_SIGMA_PX = 1.5
C1 = (0.01 * PEAK) ** 2
C2 = (0.03 * PEAK) ** 2
"""(K1 L)^2 and (K2 L)^2, with the K of Wang et al. 2004, section III.C."""

ROWS_AT_ONCE = 64
"""Rows that are worked on together, so that memory beside the two pictures stays at some ten MB."""


@dataclass(frozen=True)
class Similarity:
    """The similarity of two pictures."""

    psnr_y_db: float
    """Infinite for identical lumas."""
    psnr_rgb_db: float
    """Infinite for identical pictures."""
    ssim: float
    """The structural similarity, -1 to 1; 1 for identical lumas, NaN for a picture smaller than the window."""


@dataclass(frozen=True)
class ViewSimilarity:
    """The similarity of every view of two sheets: arrays `(v, u)`, NaN where there is no view."""

    psnr_y_db: Values
    psnr_rgb_db: Values
    ssim: Values


@dataclass(frozen=True)
class Spread:
    """The statistics of one number over the views."""

    mean: float
    minimum: float
    deviation: float
    """Standard deviation, of the views as they are (divided by their count)."""
    worst: tuple[int, int] | None
    """(u, v) of the view with the minimum, the first of several; None if all have the same number, or none."""
    infinite: int
    """The number of views that are identical, so that their PSNR is infinite; the other numbers leave them out."""


def compare(first: Codes, second: Codes) -> Similarity:
    """Compute the PSNR and SSIM of two pictures; the order does not matter.

    Parameters
    ----------
    first, second
        `(rows, cols, 3)`, 8-bit sRGB codes, any strides.

    Raises
    ------
    LayoutError
        If they differ in size, are empty, or are not 8-bit codes of three channels.

    Examples
    --------
    >>> grey = np.full((16, 16, 3), 100, dtype=np.uint8)
    >>> likeness = compare(grey, grey + np.uint8(1))
    >>> round(likeness.psnr_y_db, 2), round(likeness.psnr_rgb_db, 2), round(likeness.ssim, 5)
    (48.13, 48.13, 0.99995)
    """
    _check_pictures(first, second)
    squares_y = squares_rgb = 0.0
    for rows in _strips(len(first)):
        difference = np.subtract(first[rows], second[rows], dtype=np.float64)
        squares_y += float(np.square(difference @ WEIGHTS).sum())
        squares_rgb += float(np.square(difference).sum())
    px = first.shape[0] * first.shape[1]
    return Similarity(psnr_db(squares_y / px), psnr_db(squares_rgb / (3 * px)), ssim(first, second))


def psnr_db(mse: float) -> float:
    """Return the peak signal-to-noise ratio of a mean squared error of 8-bit codes, dB; infinite for 0.

    >>> round(psnr_db(1.0), 4)
    48.1308
    """
    return 10 * math.log10(PEAK * PEAK / mse) if mse > 0 else math.inf


def ssim(first: Codes, second: Codes) -> float:
    """Return the mean structural similarity of the lumas of two pictures.

    Parameters
    ----------
    first, second
        `(rows, cols, 3)`, 8-bit sRGB codes, any strides.

    Returns
    -------
    float
        From -1 to 1; NaN if no window lies inside the pictures, because they have fewer than 11 rows or cols.

    Raises
    ------
    LayoutError
        As `compare`.
    """
    _check_pictures(first, second)
    rows, cols = len(first) - WINDOW_PX + 1, first.shape[1] - WINDOW_PX + 1
    if min(rows, cols) < 1:
        return math.nan
    total = 0.0
    for places in _strips(rows):
        needed = slice(places.start, places.stop + WINDOW_PX - 1)
        total += float(_ssim_map(first[needed] @ WEIGHTS, second[needed] @ WEIGHTS).sum())
    return float(total / (rows * cols))


def compare_views(first: Codes, second: Codes, layout: CellLayout) -> ViewSimilarity:
    """Compute the PSNR and SSIM of every view of two orthoscopic sheets, `(v, u)`; see `compare`.

    Hexagonal views are compared as they are, one pixel a lens, every other row half a lens further right.

    Parameters
    ----------
    first, second
        Orthoscopic sheets `(rows, cols, 3)`, 8-bit sRGB codes.
    layout
        How their pixels lie under the lenses.

    Raises
    ------
    LayoutError
        As `compare`, or if the sheets are not of this layout.
    """
    _check_pictures(first, second)
    check_sheet(first, layout)
    grids = views_grid(first, layout), views_grid(second, layout)
    shape = (layout.cell_rows, layout.cell_cols)
    likeness = ViewSimilarity(*(np.full(shape, np.nan) for _ in range(3)))
    for u, v in view_numbers(layout):
        one = compare(*(view_of_grid(grid, layout, u, v) for grid in grids))
        likeness.psnr_y_db[v, u] = one.psnr_y_db
        likeness.psnr_rgb_db[v, u] = one.psnr_rgb_db
        likeness.ssim[v, u] = one.ssim
    return likeness


def spread(values: Values) -> Spread:
    """Compute the statistics of one number over the views, `(v, u)`; NaN is left out.

    Identical views have an infinite PSNR; mean, minimum and deviation are of the others, and infinite, infinite and 0
    if there are no others.

    >>> spread(np.array([[40.0, 42.0], [np.inf, np.nan]]))
    Spread(mean=41.0, minimum=40.0, deviation=1.0, worst=(0, 0), infinite=1)
    """
    known = values[~np.isnan(values)]
    if known.size == 0:
        return Spread(math.nan, math.nan, math.nan, None, 0)
    finite = known[np.isfinite(known)]
    infinite = known.size - finite.size
    if finite.size == 0:
        return Spread(math.inf, math.inf, 0.0, None, infinite)
    v, u = np.unravel_index(int(np.nanargmin(values)), values.shape)
    worst = None if known.max() == known.min() else (int(u), int(v))
    return Spread(float(finite.mean()), float(finite.min()), float(finite.std()), worst, infinite)


def _ssim_map(x: Values, y: Values) -> Values:
    """Return the SSIM at every place of the window inside two lumas; Wang et al. 2004, eq. (13)."""
    mean_x, mean_y = _windowed(x), _windowed(y)
    both = mean_x * mean_y
    squares = mean_x**2 + mean_y**2
    covariance = _windowed(x * y) - both
    # Only the sum of the two variances is needed, so one filtering does for both.
    variances = _windowed(x**2 + y**2) - squares
    similar: Values = (2 * both + C1) * (2 * covariance + C2) / ((squares + C1) * (variances + C2))
    return similar


def _windowed(values: Values) -> Values:
    """Return the Gaussian-weighted means `(rows - 10, cols - 10)`: along rows, then along cols."""
    rows, cols = (side - WINDOW_PX + 1 for side in values.shape)
    weights = _window()
    across = sum(weight * values[:, k : k + cols] for k, weight in enumerate(weights))
    down: Values = sum(weight * across[k : k + rows] for k, weight in enumerate(weights))
    return down


def _window() -> Values:
    """Return the Gaussian along one axis, `(11,)`, of sum 1; its outer product with itself is the window."""
    away_px = np.arange(WINDOW_PX) - WINDOW_PX // 2
    heights = np.exp(-0.5 * (away_px / WINDOW_SIGMA_PX) ** 2)
    weights: Values = heights / heights.sum()
    return weights


def _strips(rows: int) -> Iterator[slice]:
    for start in range(0, rows, ROWS_AT_ONCE):
        yield slice(start, min(start + ROWS_AT_ONCE, rows))


def _check_pictures(first: Codes, second: Codes) -> None:
    for picture in (first, second):
        if picture.ndim != 3 or picture.shape[2] != 3 or picture.size == 0 or picture.dtype != np.uint8:
            raise LayoutError(f"expected 8-bit codes (rows, cols, 3), got {picture.dtype} {picture.shape}")
    if first.shape != second.shape:
        (rows, cols, _), (other_rows, other_cols, _) = first.shape, second.shape
        raise LayoutError(f"expected the same size twice, got {cols} x {rows} px and {other_cols} x {other_rows} px")
