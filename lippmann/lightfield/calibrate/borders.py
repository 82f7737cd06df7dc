"""Check a lattice by the borders between its cells: what is shown breaks off there, and nowhere else.

Two pixels on either side of a border look in opposite directions, through neighbouring lenses. So they differ much
more than two pixels as far apart inside a cell, and about as much as the same places of neighbouring cells, which are a
whole pitch apart. Across the borders of the blocks of a codec what is shown goes on: there, neighbours are nearly as
alike as anywhere. At half the pitch, every second line is no border. And edges of things that are shown in many cells
repeat with another step than the pitch: such a lattice fits only in some parts of the picture, or at some places along
its borders.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lightfield.calibrate.phases import Lay, Measured

APART_PX = 3.0
"""The distance of two pixels that are compared, px: a border may be smeared over two."""

ALONG = (-0.25, -0.125, 0.0, 0.125, 0.25)
"""The places on a border, from its middle, pitches."""

INSIDE = (-0.5, -0.35, 0.35, 0.5)
"""The places inside a cell, from the border in its direction, pitches."""

PARTS = (2, 3, 5)
"""Borders are counted by their number modulo these: of a whole part of the pitch, not all classes are borders."""

LINES_A_CLASS = 4
"""The least number of lines of borders whose mean step is compared with that of all."""

REGIONS, LENSES_A_REGION = 4, 4
"""The parts of a picture along each side, and the least number of lenses by which a part counts."""

LENSES = 1500
"""The largest number of lenses at which it is looked."""

DRAWN = 200_000
"""The largest number of lenses among which those are chosen, so that the memory does not grow with the picture."""

REFINING_LENSES = 1000
"""The largest number of lenses by which a lattice is refined."""

SHARP_PX = 1.0
"""The distance of two pixels by whose difference a lattice is refined at last, px."""

STRIDE_PX = 0.6
"""The first stride by which the middle and the edges of a lattice are moved, px."""

LEAST_LENSES = 9
"""The lenses, with all their neighbours on the picture, that are needed."""

_Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class Breaks:
    """The steps of the tone at the borders of a lattice, the least of its directions."""

    than_inside: float
    """The mean step at a border by that inside the cells."""
    than_a_pitch: float
    """The mean step at a border by the mean difference of the same places of neighbouring cells."""
    evenness: float
    """The mean step at every second, third or fifth border by that at all, the least of all classes."""
    everywhere: float
    """The mean step at a border by that inside the cells, which three of four parts of the picture exceed."""

    along: float
    """The mean step at one place along a border by that at all, the least of all places."""

    alike: float
    """The mean step at one place inside the cells by that at another, the least of all: at twice or three times the
    pitch, one of them is a border too."""

    @property
    def strength(self) -> float:
        """The product of both steps: how clearly what is shown breaks off."""
        return self.than_inside * self.than_a_pitch


def breaks_of(tone: NDArray[np.float32], measured: Measured) -> Breaks:
    """Measure how much more a picture changes at the borders of a lattice than elsewhere.

    Parameters
    ----------
    tone
        `(rows, cols)`; see `evidence.tone_of`.
    measured
        The lattice.
    """
    numbers = _lenses(measured, tone.shape)
    if len(numbers) < LEAST_LENSES:
        return Breaks(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    found = [_steps(tone, measured, numbers, step) for step in _directions(measured.lay)]
    parts = _parts(measured, numbers, tone.shape)
    shares = [_share(one.border[part], one.inside[part]) for one in found for part in parts]
    return Breaks(
        than_inside=min(_share(one.border, one.inside) for one in found),
        than_a_pitch=min(_share(one.border, one.cells) for one in found),
        evenness=min(_evenness(one.border, numbers[:, axis]) for axis, one in enumerate(found[:2])),
        everywhere=float(np.percentile(shares, 25)) if shares else 0.0,
        along=min(one.along for one in found),
        alike=min(one.alike for one in found),
    )


@dataclass(frozen=True)
class _Steps:
    """The mean steps of the tone by lens, in one direction."""

    border: NDArray[np.float32]
    inside: NDArray[np.float32]
    cells: NDArray[np.float32]
    along: float
    alike: float


def _steps(tone: NDArray[np.float32], measured: Measured, numbers: NDArray[np.intp], step: _Numbers) -> _Steps:
    places, half = _borders(measured, numbers, step)
    before, after = _tone_at(tone, places - half), _tone_at(tone, places + half)
    insides = [np.abs(_step(tone, places + part * step, half)) for part in INSIDE]
    inside = np.mean(insides, axis=0)
    cells = np.mean(
        [np.abs(one - _tone_at(tone, places + side * half + step)) for side, one in ((-1, before), (1, after))], axis=0
    )
    border = np.abs(before - after)
    along = min(_share(one, border) for one in border.T)
    middle, beside = (insides[0] + insides[3]) / 2, (insides[1] + insides[2]) / 2
    alike = min(_share(middle, beside), _share(beside, middle))
    return _Steps(border.mean(axis=1), inside.mean(axis=1), cells.mean(axis=1), along, alike)


def _share(border: NDArray[np.floating[Any]], other: NDArray[np.floating[Any]]) -> float:
    return float(border.mean()) / max(float(other.mean()), float(np.finfo(np.float32).eps))


def _evenness(border: NDArray[np.float32], numbers: NDArray[np.intp]) -> float:
    """Return the least mean of every second border, and so on, by that of all.

    A class has several lines of borders, or does not count.
    """
    lines = len(np.unique(numbers))
    parts = [part for part in PARTS if lines >= part * LINES_A_CLASS]
    classes = [border[numbers % part == rest] for part in parts for rest in range(part)]
    return min((_share(one, border) for one in classes), default=1.0)


def _parts(measured: Measured, numbers: NDArray[np.intp], size: tuple[int, ...]) -> list[NDArray[np.bool_]]:
    """Return which lenses are in each part of the picture."""
    places = np.array(measured.centre_px[::-1]) + numbers @ measured.lay.steps
    col, row = (places * REGIONS // np.array(size[::-1])).astype(int).T
    parts = [(row == down) & (col == right) for down, right in product(range(REGIONS), repeat=2)]
    return [part for part in parts if part.sum() >= LENSES_A_REGION]


def refined(tone: NDArray[np.float32], measured: Measured) -> Measured:
    """Refine a lattice so that its borders lie where the picture changes most, first roughly, then exactly.

    Parameters
    ----------
    tone
        `(rows, cols)`; see `evidence.tone_of`.
    measured
        A lattice whose borders are within two pixels of those of the picture, all over it.
    """
    for apart_px in (APART_PX, SHARP_PX):
        measured = _refined(tone, measured, apart_px)
    return measured


def _refined(tone: NDArray[np.float32], measured: Measured, apart_px: float) -> Measured:
    from scipy.optimize import minimize

    numbers = _lenses(measured, tone.shape)[:REFINING_LENSES]
    reach = max(tone.shape) / 2

    def moved(px: _Numbers) -> Measured:
        """Return the lattice with its middle and its edges moved by so many pixels."""
        lay, (down, right) = measured.lay, measured.centre_px
        new = Lay(
            lay.lattice,
            lay.pitch_px * (1 + float(px[2]) / reach),
            lay.row_pitch_px * (1 + float(px[3]) / reach),
            lay.turn_deg + math.degrees(float(px[4]) / reach),
        )
        return Measured(new, (down + float(px[0]), right + float(px[1])), measured.agreement)

    def lost(px: _Numbers) -> float:
        one = moved(px)
        return -sum(
            float(np.abs(_step(tone, *_borders(one, numbers, step, apart_px=apart_px))).mean())
            for step in _directions(one.lay)
        )

    start = np.vstack((np.zeros(5), STRIDE_PX * np.eye(5)))
    found = minimize(
        lost, start[0], method="Nelder-Mead", options={"initial_simplex": start, "xatol": 0.01, "maxfev": 200}
    )
    return moved(found.x)


def _directions(lay: Lay) -> _Numbers:
    """Return the steps to the neighbours across the borders of a cell, `(direction, (right, down))`."""
    along, down = lay.steps
    return np.stack((along, down, down - along) if lay.lattice == "hexagonal" else (along, down))


def _borders(
    measured: Measured, numbers: NDArray[np.intp], step: _Numbers, *, apart_px: float = APART_PX
) -> tuple[_Numbers, _Numbers]:
    """Return places on the borders of lenses in one direction, `(lens, place, 2)`, and half the step across them."""
    pitch = float(np.hypot(*step))
    ahead = step / pitch
    aside = np.array([-ahead[1], ahead[0]])
    lenses = np.array(measured.centre_px[::-1]) + numbers @ measured.lay.steps
    return lenses[:, np.newaxis] + step / 2 + np.array(ALONG)[:, np.newaxis] * pitch * aside, ahead * apart_px / 2


def _step(tone: NDArray[np.float32], places: _Numbers, half: _Numbers) -> NDArray[np.float32]:
    return _tone_at(tone, places - half) - _tone_at(tone, places + half)


def _tone_at(tone: NDArray[np.float32], places: _Numbers) -> NDArray[np.float32]:
    """Return the tone at places (right, down) from the top left corner, between pixels."""
    from scipy.ndimage import map_coordinates

    found: NDArray[np.float32] = map_coordinates(
        tone, np.moveaxis(places[..., ::-1], -1, 0) - 0.5, order=1, mode="nearest"
    )
    return found


def _lenses(measured: Measured, size: tuple[int, ...]) -> NDArray[np.intp]:
    """Return the numbers of lenses all over a picture, in steps of the lattice, `(lens, 2)`."""
    lay = measured.lay
    back = np.linalg.inv(lay.steps)
    middle = np.array(measured.centre_px[::-1])
    corners = (np.array(list(product((0, size[1]), (0, size[0])))) - middle) @ back
    ranges = [
        np.arange(math.floor(low), math.ceil(high) + 1)
        for low, high in zip(corners.min(0), corners.max(0), strict=True)
    ]
    rng = np.random.default_rng(0)
    if math.prod(map(len, ranges)) <= DRAWN:
        numbers = np.stack(np.meshgrid(*ranges), axis=-1).reshape(-1, 2)
    else:
        numbers = np.unique(np.stack([rng.choice(one, DRAWN) for one in ranges], axis=-1), axis=0)
    centres = middle + numbers @ lay.steps
    margin = 1.5 * lay.pitch_px
    numbers = numbers[((centres > margin) & (centres < np.array(size[::-1]) - margin)).all(axis=1)]
    # In any order, so that some of them are all over the picture.
    return rng.permutation(numbers)[:LENSES]
