"""Autofocus: the depth at which the refocused picture is sharpest around a place.

A patch is refocused to many depths. Two measures are computed of each: the contrast, which is the mean square of the
gradient (Tenenbaum 1970; Krotkov, *Focusing*, Int. J. Computer Vision 1, 1987), and the variance of the views that are
averaged. Their ratio finds the depth among all, as defocus and correspondence do together (Tao, Hadap, Malik,
Ramamoorthi, *Depth from combining defocus and correspondence using light-field cameras*, ICCV 2013). The contrast alone
finds the sharpest depth around one that is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.refocus.shift_and_sum import shifts
from lippmann.lightfield.sheet.interpolation import neighbours
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view, view_numbers

HALF_PX = 4
"""Half the side of the patch, in pixels of a view."""
SEARCH_STEP = 0.25
"""The step of the search for a depth, in focal lengths of the lenses."""
SEARCHED_VIEWS = 8
"""The greatest number of views in a row that the search compares, evenly spaced among all."""
REFINED = 0.75
"""The distance to either side of a known depth in which the sharpest one is found, in focal lengths. Views that are
shifted by whole pixels are sharper than interpolated ones, which moves the sharpest depth by up to half of one."""
REFINED_STEPS = 12
"""The number of steps to either side of a known depth."""
SEARCHED_DEPTHS = 200
"""The greatest number of depths of a search."""
FLOOR = 1e-4
"""The contrast and variance, squares of 1 % of white, below which noise and rounding decide."""
UNIFORM = 4e-6
"""The contrast, the square of half an 8-bit code per pixel, below which a patch is uniform at every depth."""

Light = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class FocusMeasures:
    """The measures of a patch at each depth, in tones: square roots of linear light."""

    contrast: NDArray[np.float64]
    """(depth,): the mean square of the gradient of the refocused patch."""
    variance: NDArray[np.float64]
    """(depth,): the variance of the views that are averaged, as a mean over the patch."""


def find_focus(
    image: IntegralImage, place: tuple[int, int], eye: tuple[float, float], ends_mm: tuple[float, float]
) -> float | None:
    """Find the depth of what a view shows at a place; None where the picture is uniform.

    Parameters
    ----------
    image
        An orthoscopic image.
    place
        The (row, col) of square pixels.
    eye
        The view (u, v) in which the place is meant; fractional numbers lie between views.
    ends_mm
        The farthest and the nearest depth, mm in front of the display.

    Raises
    ------
    LayoutError
        If the image is pseudoscopic.
    """
    low_mm, high_mm = ends_mm
    count = round((high_mm - low_mm) / (SEARCH_STEP * image.focal_length_mm)) + 1
    depths_mm = np.linspace(low_mm, high_mm, min(max(3, count), SEARCHED_DEPTHS))
    found = focus_measures(image, place, eye, depths_mm, most_views=SEARCHED_VIEWS)
    if found.contrast.max() < UNIFORM:
        return None
    likely = float(depths_mm[np.argmin((found.variance + FLOOR) / (found.contrast + FLOOR))])
    return sharpest_depth(image, place, eye, likely)


def sharpest_depth(image: IntegralImage, place: tuple[int, int], eye: tuple[float, float], depth_mm: float) -> float:
    """Return the depth of highest contrast close to a depth that is known, mm; see `REFINED`.

    Where the contrast has no maximum there, as in a uniform patch, it is the known depth.

    Parameters
    ----------
    image, place, eye
        As in `find_focus`.
    depth_mm
        The known depth, mm in front of the display.

    Raises
    ------
    LayoutError
        If the image is pseudoscopic.
    """
    reach_mm = REFINED * image.focal_length_mm
    depths_mm = depth_mm + np.linspace(-reach_mm, reach_mm, 2 * REFINED_STEPS + 1)
    contrast = focus_measures(image, place, eye, depths_mm).contrast
    best = int(np.argmax(contrast))
    is_peak = 0 < best < len(depths_mm) - 1 and contrast[best] >= UNIFORM
    return float(depths_mm[best]) if is_peak else depth_mm


def focus_measures(
    image: IntegralImage,
    place: tuple[int, int],
    eye: tuple[float, float],
    depths_mm: Sequence[float] | NDArray[np.float64],
    *,
    most_views: int | None = None,
) -> FocusMeasures:
    """Return the contrast and the variance of the views in the patch around a place, refocused to several depths.

    Parameters
    ----------
    image, place, eye
        As in `find_focus`.
    depths_mm
        The depths, mm in front of the display.
    most_views
        The greatest number of views in a row that are averaged; None for all.

    Raises
    ------
    LayoutError
        If the image is pseudoscopic.
    """
    image.check_orthoscopic()
    layout = image.layout
    rows, cols = layout.square_size()
    side = np.arange(-HALF_PX, HALF_PX + 1)
    patch_rows = place[0] + side[np.maximum(0, HALF_PX - place[0]) : HALF_PX + rows - place[0]]
    patch_cols = place[1] + side[np.maximum(0, HALF_PX - place[1]) : HALF_PX + cols - place[1]]
    moves = np.array([shifts(layout, float(depth_mm), focal_mm=image.focal_length_mm) for depth_mm in depths_mm])
    light = np.zeros((len(moves), len(patch_rows), len(patch_cols), image.pixels.shape[2]))
    tones, squares, counts = np.zeros_like(light), np.zeros_like(light), np.zeros((*light.shape[:3], 1))
    for u, v in _spread_views(layout.cell_rows, layout.cell_cols, view_numbers(layout), most_views):
        picture = as_square(view(image.pixels, layout, u, v), layout)
        seen, there = _sampled(
            picture, patch_rows - moves[:, :1] * (v - eye[1]), patch_cols - moves[:, 1:] * (u - eye[0])
        )
        tone = np.sqrt(np.clip(seen, 0, None))
        for total, one in ((light, seen), (tones, tone), (squares, tone * tone), (counts, 1.0)):
            total += one * there
    counts = np.maximum(counts, 1)
    spread = squares / counts - (tones / counts) ** 2
    shown = np.sqrt(np.clip(light / counts, 0, None))
    down, across = np.gradient(shown, axis=(1, 2))
    return FocusMeasures(
        contrast=(down**2 + across**2).sum(axis=-1).mean(axis=(1, 2)), variance=spread.sum(axis=-1).mean(axis=(1, 2))
    )


def _spread_views(rows: int, cols: int, numbers: Sequence[tuple[int, int]], most: int | None) -> list[tuple[int, int]]:
    if most is None:
        return list(numbers)
    us, vs = (set(np.linspace(0, count - 1, min(count, most)).round().astype(int).tolist()) for count in (cols, rows))
    return [(u, v) for u, v in numbers if u in us and v in vs]


def _sampled(
    picture: Light, at_rows: NDArray[np.float64], at_cols: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a picture at fractional rows and cols, each (depth, place), and 1 where it reaches, `(..., 1)`."""
    rows, cols = picture.shape[:2]
    there = ((at_rows >= 0) & (at_rows <= rows - 1))[:, :, np.newaxis] & ((at_cols >= 0) & (at_cols <= cols - 1))[
        :, np.newaxis
    ]
    (top, below, down), (left, right, across) = neighbours(at_rows, 0, rows - 1), neighbours(at_cols, 0, cols - 1)
    down, across = down[:, :, np.newaxis, np.newaxis], across[:, np.newaxis, :, np.newaxis]
    upper, lower = (
        picture[row[:, :, np.newaxis], left[:, np.newaxis]] * (1 - across)
        + picture[row[:, :, np.newaxis], right[:, np.newaxis]] * across
        for row in (top, below)
    )
    return upper * (1 - down) + lower * down, there[..., np.newaxis].astype(np.float64)
