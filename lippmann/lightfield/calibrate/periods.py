"""Estimate the two shortest steps from lens to lens by autocorrelation.

Shifted by a step of the lattice, the evidence is like itself; shifted by half a step it is not. So the autocorrelation
has equally high peaks at all steps, and the shortest of these are the ones: twice the pitch is as high a peak but
longer, half the pitch is no step. (Higher orders of waves may be stronger than the first; those of steps are not.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

LARGEST_PX = 1024
"""The part of each side, in the middle, from which the first estimate is made, px."""

SHORTEST_PX = 3.0
"""The shortest step that is searched, px; below it the smoothness of the picture itself dominates."""

LENSES_ACROSS = 4
"""The least number of lenses along the shorter side of the picture."""

HIGH = 0.7
"""The share of the highest peak that a step of the lattice reaches, although fewer lenses overlap at long steps."""

APART = 0.6
"""Sine of the least angle between two steps: 37 degrees."""


@dataclass(frozen=True)
class Steps:
    """The two shortest steps of a lattice, px, `(right, down)`; no sign and no order."""

    first: NDArray[np.float64]
    second: NDArray[np.float64]


def shortest_steps(evidence: NDArray[np.floating[Any]]) -> Steps | None:
    """Return the two shortest steps of the lattice in the evidence `(rows, cols)`; None if there are none."""
    middle = _middle(evidence)
    likeness = _autocorrelation(middle)
    peaks, heights = _peaks(likeness, longest=min(middle.shape) / LENSES_ACROSS)
    if not len(peaks) or heights.max() <= 0:
        return None
    high = peaks[heights >= HIGH * heights.max()]
    by_length = high[np.argsort(np.hypot(*high.T))]
    first = by_length[0]
    cross = np.abs(first[0] * by_length[:, 1] - first[1] * by_length[:, 0])
    apart = cross >= APART * np.hypot(*first) * np.hypot(*by_length.T)
    if not apart.any():
        return None
    return Steps(_walked(likeness, first), _walked(likeness, by_length[apart][0]))


def _middle(evidence: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
    starts = [max(0, (side - LARGEST_PX) // 2) for side in evidence.shape]
    return evidence[tuple(slice(start, start + LARGEST_PX) for start in starts)]


def _autocorrelation(field: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Return how like itself a field is when shifted by (row, col), to half its size; lag 0 in the middle."""
    from scipy.fft import irfft2, next_fast_len, rfft2

    rows, cols = field.shape
    size = next_fast_len(2 * rows, real=True), next_fast_len(2 * cols, real=True)
    spectrum = rfft2(field - field.mean(), size)
    product = irfft2(spectrum.real**2 + spectrum.imag**2, size)
    half = rows // 2, cols // 2
    lags = [np.arange(-reach, reach + 1) for reach in half]
    overlap = np.outer(rows - np.abs(lags[0]), cols - np.abs(lags[1]))
    likeness: NDArray[np.float64] = product[np.ix_(lags[0], lags[1])] / overlap
    return likeness


def _peaks(likeness: NDArray[np.float64], *, longest: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where the autocorrelation has peaks, `(peak, (right, down))`, one of two opposite ones, and how high."""
    from scipy.ndimage import maximum_filter

    middle = np.array(likeness.shape) // 2
    top = (likeness == maximum_filter(likeness, 3)) & (likeness > 0)
    top[: middle[0]] = False
    top[middle[0], : middle[1] + 1] = False
    at = np.argwhere(top)
    length = np.hypot(*(at - middle).T)
    inside = (at > 0).all(axis=1) & (at < np.array(likeness.shape) - 1).all(axis=1)
    at = at[(length >= SHORTEST_PX) & (length <= longest) & inside]
    found = [_summit(likeness, row, col) for row, col in at]
    places = np.array([place for place, _ in found]).reshape(-1, 2) - middle
    return places[:, ::-1], np.array([height for _, height in found])


def _summit(likeness: NDArray[np.float64], row: int, col: int) -> tuple[tuple[float, float], float]:
    """Return place and height of a peak between pixels: parabolas through three along each axis."""
    height = likeness[row, col]
    place = []
    for at, (before, after) in (
        (row, (likeness[row - 1, col], likeness[row + 1, col])),
        (col, (likeness[row, col - 1], likeness[row, col + 1])),
    ):
        bend = before - 2 * likeness[row, col] + after
        along = 0.0 if bend >= 0 else float(np.clip((before - after) / (2 * bend), -0.5, 0.5))
        height -= bend * along**2 / 2
        place.append(at + along)
    return (place[0], place[1]), float(height)


def _walked(likeness: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a step measured over more and more lenses: twice as many each time."""
    middle = np.array(likeness.shape) // 2
    count, height = 1, -np.inf
    while True:
        guess = np.round(middle + 2 * count * step[::-1]).astype(int)
        if (guess < 3).any() or (guess >= np.array(likeness.shape) - 3).any():
            return step
        around = likeness[guess[0] - 2 : guess[0] + 3, guess[1] - 2 : guess[1] + 3]
        row, col = np.unravel_index(np.argmax(around), around.shape)
        if not (0 < row < 4 and 0 < col < 4):
            return step  # what is there is another peak's flank
        place, summit = _summit(likeness, guess[0] - 2 + int(row), guess[1] - 2 + int(col))
        if summit < height / 2:
            return step
        count, height = 2 * count, max(height, summit)
        step = (np.array(place) - middle)[::-1] / count
