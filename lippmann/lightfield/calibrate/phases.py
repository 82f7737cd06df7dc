"""Refine pitch, rotation and position of a lattice to a fraction of a pixel, by the phases of its waves.

The evidence repeats from lens to lens, so it is a sum of waves; the longest of them, two on the square lattice and
three on the hexagonal one, are dual to the steps. A wave's phase is taken in many overlapping windows: what is left
of it, once the rough wave is taken out, lies on a plane over the picture, whose slope corrects the wave and whose
height says where lenses are. Windows whose phases do not lie on it disprove the lattice.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.cell import Lattice
from lippmann.lattice.kinds import CELLS
from lippmann.lightfield.calibrate.periods import Steps

WINDOWS = 12
"""The number of windows along each side, before they overlap, if they hold enough lenses."""

LENSES_A_WINDOW = 5
"""The least number of lenses in a window, so that neighbouring waves are resolved."""

LONGEST_WAVES: dict[Lattice, tuple[tuple[int, int], ...]] = {
    "square": ((1, 0), (0, 1)),
    "hexagonal": ((1, 0), (0, 1), (1, 1)),
}
"""The longest waves of a lattice, in waves dual to its steps."""

PASSES = 12
"""The largest number of passes; each removes most of the remaining error."""

ALIKE = 0.17
"""The largest relative difference of the two steps in length, and of their angle from that of the lattice, radians."""

UPRIGHT_DEG = 15.0
"""A hexagonal lattice turned further stands on its side: there columns are shifted, not rows."""

_Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class Lay:
    """The lattice in a picture: kind, pitch, row pitch and rotation."""

    lattice: Lattice
    pitch_px: float
    row_pitch_px: float
    turn_deg: float
    """The rotation of the lens rows, degrees, clockwise in the picture."""

    @property
    def steps(self) -> _Numbers:
        """The steps to the next lens of the row and to one of the next row: below, or half a lens right; `(2, 2)`."""
        turn = math.radians(self.turn_deg)
        along = self.pitch_px * np.array([math.cos(turn), math.sin(turn)])
        down = self.row_pitch_px * np.array([-math.sin(turn), math.cos(turn)])
        return np.stack((along, down + along * CELLS[self.lattice].row_shift))


@dataclass(frozen=True)
class Measured:
    """A lattice with the position of one lens, and the agreement of the picture."""

    lay: Lay
    centre_px: tuple[float, float]
    """The centre of a lens near the middle of the picture, `(down, right)` from its top left corner."""
    agreement: float
    """The agreement of the windows' phases, 0 to 1, the least of all waves; noise has about 1 / sqrt(windows)."""


def lay_of(steps: Steps) -> Lay | None:
    """Return the lattice that two shortest steps make; None if they make neither kind, or hexagons on their side."""
    lengths = [float(np.hypot(*step)) for step in (steps.first, steps.second)]
    between = math.acos(abs(float(steps.first @ steps.second)) / (lengths[0] * lengths[1]))
    unlike = abs(lengths[1] / lengths[0] - 1)
    if unlike <= ALIKE and abs(between - math.pi / 2) <= ALIKE:
        along, down = _flattest((steps.first, steps.second))
        return _lay("square", along, down)
    if unlike <= ALIKE and abs(between - math.pi / 3) <= ALIKE:
        third = steps.second - np.sign(steps.first @ steps.second) * steps.first
        along, *others = _flattest((steps.first, steps.second, third))
        down = next((step for step in others if (step if step[1] > 0 else -step) @ along > 0), others[0])
        lay = _lay("hexagonal", along, down)
        return lay if abs(lay.turn_deg) <= UPRIGHT_DEG else None
    return None


def measure(evidence: NDArray[np.floating[Any]], rough: Lay) -> Measured:
    """Refine a rough lattice by the phases of its waves.

    Parameters
    ----------
    evidence
        `(rows, cols)`, float64: bright where lenses are.
    rough
        A lattice near the one of the picture, px.
    """
    orders = LONGEST_WAVES[rough.lattice]
    waves = [_wave(evidence, np.array(order) @ np.linalg.inv(rough.steps.T), rough) for order in orders]
    lay = fitted_lay(rough, orders, waves)
    phases = np.array(
        [np.angle(wave_light(evidence, np.array(order) @ np.linalg.inv(lay.steps.T))) for order in orders[:2]]
    )
    from_middle = -(phases / (2 * math.pi)) @ lay.steps
    right, down = np.array(evidence.shape[::-1]) / 2 + from_middle
    return Measured(lay, (float(down), float(right)), min(wave.agreement for wave in waves))


@dataclass(frozen=True)
class Wave:
    """A wave, and its reliability."""

    number: _Numbers
    """Waves a pixel, `(right, down)`."""
    agreement: float
    phase: float = 0.0
    """The phase in the middle of the picture."""


def _flattest(steps: tuple[_Numbers, ...]) -> list[_Numbers]:
    """Return steps by how little they lean, the first to the right."""
    by_lean = sorted(steps, key=lambda step: abs(math.atan2(step[1], abs(step[0]))))
    return [by_lean[0] if by_lean[0][0] > 0 else -by_lean[0], *by_lean[1:]]


def _lay(lattice: Lattice, along: _Numbers, down: _Numbers) -> Lay:
    pitch = float(np.hypot(*along))
    row_pitch = abs(float(along[0] * down[1] - along[1] * down[0])) / pitch
    return Lay(lattice, pitch, row_pitch, math.degrees(math.atan2(along[1], along[0])))


def _wave(evidence: NDArray[np.floating[Any]], number: _Numbers, rough: Lay) -> Wave:
    """Return a wave near a rough one: as long as the windows' phases still lie aslant, it is corrected."""
    centres, lights = _windows(evidence, number, least_px=LENSES_A_WINDOW * rough.pitch_px)
    weights = np.abs(lights)
    slope = np.zeros(2)
    for _ in range(PASSES):
        left = lights * np.exp(-2j * math.pi * (centres @ slope))
        phases = np.angle(left * np.conj(left.sum()))
        design = np.column_stack((centres, np.ones(len(centres)))) * weights[:, np.newaxis]
        change = np.linalg.lstsq(design, phases * weights / (2 * math.pi), rcond=None)[0][:2]
        slope = slope + change
        if np.abs(change).max() * max(evidence.shape) < 1e-6:
            break
    left = lights * np.exp(-2j * math.pi * (centres @ slope))
    return Wave(number + slope, float(abs(left.sum()) / max(weights.sum(), np.finfo(float).tiny)))


def _windows(
    evidence: NDArray[np.floating[Any]], number: _Numbers, *, least_px: float
) -> tuple[_Numbers, NDArray[np.complex128]]:
    """Return the middles of windows, from the picture's, `(window, (right, down))`, and the wave in each."""
    down, right = (_tapers(side, least_px) for side in evidence.shape)
    waves = [
        taper * np.exp(-2j * math.pi * along * from_middle(taper.shape[1]))
        for taper, along in ((down, number[1]), (right, number[0]))
    ]
    lights = waves[0] @ evidence @ waves[1].T
    middles = [taper @ from_middle(taper.shape[1]) / taper.sum(axis=1) for taper in (down, right)]
    centres = np.stack(np.meshgrid(middles[1], middles[0]), axis=-1).reshape(-1, 2)
    return centres, lights.ravel()


def _tapers(side: int, least_px: float) -> _Numbers:
    """Return Hann windows that overlap by half, `(window, px)`."""
    length = min(side, max(math.ceil(least_px), side // WINDOWS, 8))
    count = max(1, round(2 * side / length) - 1)
    starts = np.linspace(0, side - length, count)
    at = (np.arange(side) + 0.5 - starts[:, np.newaxis]) / length
    return np.where((at > 0) & (at < 1), np.sin(math.pi * at) ** 2, 0.0)


def wave_light(evidence: NDArray[np.floating[Any]], number: _Numbers) -> complex:
    """Return the complex amplitude of a wave, whose phase is that in the middle of the picture.

    Parameters
    ----------
    evidence
        `(rows, cols)`, float64.
    number
        The wave number (right, down), waves per px.
    """
    down, right = (from_middle(side) for side in evidence.shape)
    taper = [np.cos(math.pi * at / len(at)) ** 2 for at in (down, right)]
    waves = [np.exp(-2j * math.pi * along * at) for along, at in ((number[1], down), (number[0], right))]
    return complex((waves[0] * taper[0]) @ evidence @ (waves[1] * taper[1]))


def from_middle(side: int) -> _Numbers:
    """Return the positions of the pixels of a line, px from its middle."""
    return np.arange(side, dtype=np.float64) + (0.5 - side / 2)


def fitted_lay(rough: Lay, orders: tuple[tuple[int, int], ...], waves: list[Wave]) -> Lay:
    """Fit a lattice of right angles to waves, by least squares weighted by their agreement.

    Parameters
    ----------
    rough
        The lattice from which the fit starts, px.
    orders
        The order of each wave, in the reciprocal steps of the lattice.
    waves
        The waves that were found.
    """
    from scipy.optimize import least_squares

    weights = np.array([[wave.agreement * np.hypot(*wave.number)] for wave in waves])
    numbers = np.array([wave.number for wave in waves])

    def missed(scale: _Numbers) -> _Numbers:
        lay = Lay(
            rough.lattice, rough.pitch_px * float(scale[0]), rough.row_pitch_px * float(scale[1]),
            rough.turn_deg + math.degrees(float(scale[2])),
        )  # fmt: skip
        expected = np.array(orders) @ np.linalg.inv(lay.steps.T)
        residual: _Numbers = ((expected - numbers) * weights * rough.pitch_px).ravel()
        return residual

    scale = least_squares(missed, [1.0, 1.0, 0.0], xtol=1e-12, ftol=1e-14, gtol=1e-14).x
    return Lay(
        rough.lattice, rough.pitch_px * float(scale[0]), rough.row_pitch_px * float(scale[1]),
        rough.turn_deg + math.degrees(float(scale[2])),
    )  # fmt: skip
