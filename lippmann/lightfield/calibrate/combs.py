"""Find the lattice in any picture by the lines of its spectrum.

Neighbouring elemental images are alike, so a picture nearly repeats, but with another step than the pitch: by as much
more or less as what is shown is in front of the array or behind it. What lies on the lattice itself is only where cells
meet, at every border of the sheet alike. In the spectrum of the edges that is a comb of lines, each no broader than the
picture allows, while what is shown spreads. So lines are looked for that stand out from the spectrum about them, and
the lattice is the one with the largest pitch of which nearly all lines are there: of twice the pitch every other one
would be missing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.cell import Lattice
from lippmann.lattice.kinds import CELLS
from lippmann.lightfield.calibrate.periods import LENSES_ACROSS
from lippmann.lightfield.calibrate.phases import Lay, Measured, Wave, fitted_lay, from_middle

ORDERS: dict[Lattice, tuple[tuple[int, int], ...]] = {
    "square": tuple(order for i in range(1, 7) for order in ((i, 0), (0, i))),
    "hexagonal": ((1, 0), (0, 1), (1, 1), (2, 1), (1, 2), (1, -1), (2, 0), (0, 2), (2, 2)),
}
"""Lines, in waves dual to the steps."""

LARGEST_PX = 3000
"""The largest part of each side that is used, in the middle, px."""

LINE_PX, AROUND_PX = 7, 17
"""Squares of the spectrum: what a line fills, and about it what it is compared with."""

BY_CHANCE, BEYOND_DOUBT = 6.0, 400.0
"""Power of a line by that about it: from 0 to 1 its logarithm counts as to be seen."""

NEARLY = 0.75
"""The share of the best agreement with which a larger pitch is preferred."""

LINES, HIGHEST_ORDER = 40, 6
"""Strongest lines on each axis that are tried, and as which orders."""

LEAST_ORDERS = 4
"""Lines that must be seen at least; two place a lattice anywhere."""

MOST_TRIED, HARDLY = 12, 0.02
"""Lattices that are measured, and by how much they differ at least."""

TURNED_DEG, SKEW_DEG = 10.0, 0.7
"""The largest rotation of the rows, and the largest difference of the rotations of the two axes, degrees."""

UNLIKE: dict[Lattice, float] = {"square": 0.01, "hexagonal": 0.08}
"""The largest relative difference of the row pitch from that of square pixels, which hexagons on whole pixels have."""

NEAR = 0.03
"""The largest relative difference of a pitch from the one that is known roughly."""

NYQUIST = 0.46
"""Waves a pixel up to which lines are looked for."""

_Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class _Spectrum:
    power: _Numbers
    """Logarithms, `(row, col)`, zero frequency in the middle."""
    phase: _Numbers
    """The phase in the middle of the picture."""
    above: _Numbers
    """The contrast of each line with its neighbours, 0 to 1."""
    nearby: _Numbers
    """The most of `above` within a pixel."""

    @property
    def size(self) -> _Numbers:
        """(cols, rows)."""
        return np.array(self.power.shape[::-1])

    def at(self, number: _Numbers) -> NDArray[np.intp]:
        """Return the (col, row) of waves a pixel, `(.., (right, down))`."""
        at: NDArray[np.intp] = np.round(number * self.size + self.size // 2).astype(np.intp)
        return at


@dataclass(frozen=True)
class Comb:
    """A lattice found by its lines, and the next best candidate."""

    measured: Measured
    """The lattice; its agreement is the mean contrast and phase coherence of its lines."""
    rival: Measured | None
    """The next best that is not the same with every second or third line, or with lines between."""


def measure_comb(evidence: _Numbers, *, near_px: float | None = None) -> Comb | None:
    """Find the lattice in the evidence `(rows, cols)` by its spectral lines; None if there are none.

    Parameters
    ----------
    evidence
        See `evidence`.
    near_px
        A pitch that is known roughly: no other is looked for.
    """
    spectrum = _spectrum(evidence)
    measured = [_measured(evidence.shape, spectrum, lay) for lay in _distinct(spectrum, near_px)]
    known = [one for one in measured if one is not None]
    if not known:
        return None
    best = max(known, key=lambda one: one.agreement)
    chosen = max((one for one in known if one is best or _is_multiple(one, best)), key=lambda one: one.lay.pitch_px)
    rivals = [one for one in known if not _are_related(one.lay, chosen.lay)]
    return Comb(chosen, max(rivals, key=lambda one: one.agreement, default=None))


def _are_related(lay: Lay, other: Lay) -> bool:
    """Return whether one pitch is the other, or small whole numbers of it fit into small whole numbers of the other."""
    ratio = lay.pitch_px / other.pitch_px
    return any(abs(ratio * below / above - 1) < HARDLY for above, below in product(range(1, 6), repeat=2))


def _is_multiple(measured: Measured, best: Measured) -> bool:
    """Return whether the lines of the best are every second, third .. of these, and nearly all of these are there."""
    ratio = measured.lay.pitch_px / best.lay.pitch_px
    return (
        measured.lay.lattice == best.lay.lattice
        and measured.agreement >= NEARLY * best.agreement
        and abs(ratio - round(ratio)) < HARDLY * ratio
    )


def _distinct(spectrum: _Spectrum, near_px: float | None) -> list[Lay]:
    """Return the lattices with most lines, of those that hardly differ the best."""
    tried = sorted(((_score(spectrum, lay), lay) for lay in _lattices(spectrum, near_px)), key=lambda item: -item[0])
    distinct: list[Lay] = []
    for _, lay in tried:
        if len(distinct) == MOST_TRIED:
            break
        if not any(lay.lattice == other.lattice and _near(lay, other) for other in distinct):
            distinct.append(lay)
    return distinct


def _near(lay: Lay, other: Lay) -> bool:
    ratios = (lay.pitch_px / other.pitch_px, lay.row_pitch_px / other.row_pitch_px)
    return all(abs(ratio - 1) < HARDLY for ratio in ratios)


def _measured(size: tuple[int, ...], spectrum: _Spectrum, rough: Lay) -> Measured | None:
    """Return a lattice measured at its lines; how far it is to be believed: those in step, by how clear they are."""
    waves = {order: wave for order in ORDERS[rough.lattice] if (wave := _line(spectrum, rough, order)) is not None}
    if len(waves) < LEAST_ORDERS:
        return None
    lay = fitted_lay(rough, tuple(waves), list(waves.values()))
    centre, in_step = _centre(size, lay, waves)
    orders, _ = _numbers(lay)
    clear = sum(wave.agreement * step for wave, step in zip(waves.values(), in_step, strict=True))
    return Measured(lay, centre, max(0.0, float(clear)) / max(1, len(orders)))


def _spectrum(evidence: _Numbers) -> _Spectrum:
    from scipy.ndimage import maximum_filter, uniform_filter

    starts = [max(0, (side - LARGEST_PX) // 2) for side in evidence.shape]
    field = evidence[tuple(slice(start, start + LARGEST_PX) for start in starts)]
    tapers = [np.cos(math.pi * from_middle(side) / side) ** 2 for side in field.shape]
    light = np.fft.fftshift(np.fft.fft2((field - field.mean()) * np.outer(*tapers)))
    power = np.log(light.real**2 + light.imag**2 + np.finfo(float).tiny)
    inner, outer = (uniform_filter(power, side, mode="wrap") * side**2 for side in (LINE_PX, AROUND_PX))
    about = (outer - inner) / (AROUND_PX**2 - LINE_PX**2)
    low, high = math.log(BY_CHANCE), math.log(BEYOND_DOUBT)
    above = np.clip((power - about - low) / (high - low), 0, 1)
    row, col = ((np.arange(side) - side // 2) / side for side in power.shape)
    to_middle = np.add.outer(row * (power.shape[0] - 1) / 2, col * (power.shape[1] - 1) / 2)
    phase = np.angle(light) + 2 * math.pi * to_middle
    return _Spectrum(power, phase, above, maximum_filter(above, 3))


def _lattices(spectrum: _Spectrum, near_px: float | None) -> Iterator[Lay]:
    """Yield lattices that have a line on each axis where the spectrum has a peak."""
    level, upright = (_peaks(spectrum, axis) for axis in (0, 1))
    least = 0.0 if near_px is None else near_px * (1 - NEAR)
    most = float(spectrum.size.min()) / LENSES_ACROSS if near_px is None else near_px * (1 + NEAR)
    for across, down in product(level, upright):
        turn = math.degrees(math.atan2(across[1], across[0]))
        if abs(turn - math.degrees(math.atan2(-down[0], down[1]))) > SKEW_DEG:
            continue
        for order, row_order in product(range(1, HIGHEST_ORDER + 1), repeat=2):
            for lattice, unlike in UNLIKE.items():
                # Shifted rows halve the period across.
                pitch = CELLS[lattice].row_period * order / float(np.hypot(*across))
                row_px = row_order / float(np.hypot(*down))
                if abs(row_px / (pitch * CELLS[lattice].row_pitch) - 1) <= unlike and least <= pitch <= most:
                    yield Lay(lattice, pitch, row_px, turn)


def _peaks(spectrum: _Spectrum, axis: int) -> _Numbers:
    """Return the clearest lines near an axis, 0 level and 1 upright, as waves a pixel `(line, (right, down))`."""
    row, col = np.indices(spectrum.power.shape)
    place = np.stack((col, row), axis=-1) - spectrum.size // 2
    number = place / spectrum.size
    near = number[..., axis] > np.abs(number[..., 1 - axis]) / math.tan(math.radians(TURNED_DEG))
    top = near & (spectrum.above > 0) & (spectrum.above >= spectrum.nearby) & (number[..., axis] < NYQUIST)
    at = np.argwhere(top)
    clearest = at[np.argsort(-(spectrum.above + 1e-3 * spectrum.power)[top])][:LINES]
    return np.array([_summit(spectrum, col, row) for row, col in clearest]).reshape(-1, 2)


def _summit(spectrum: _Spectrum, col: int, row: int) -> _Numbers:
    """Return where between pixels a line is highest, as waves a pixel."""
    rows, cols = spectrum.power.shape
    row, col = min(max(row, 1), rows - 2), min(max(col, 1), cols - 2)
    place = []
    for at, line in ((col, spectrum.power[row, col - 1 : col + 2]), (row, spectrum.power[row - 1 : row + 2, col])):
        bend = float(line[0] - 2 * line[1] + line[2])
        place.append(at + (0.0 if bend >= 0 else float(np.clip((line[0] - line[2]) / (2 * bend), -0.5, 0.5))))
    summit: _Numbers = (np.array(place) - spectrum.size // 2) / spectrum.size
    return summit


def _numbers(lay: Lay) -> tuple[NDArray[np.intp], _Numbers]:
    """Return the orders of a lattice that the spectrum has room for, and their waves."""
    orders = np.array(ORDERS[lay.lattice])
    numbers = orders @ np.linalg.inv(lay.steps.T)
    room = np.abs(numbers).max(axis=1) < NYQUIST
    return orders[room], numbers[room]


def _score(spectrum: _Spectrum, lay: Lay) -> float:
    _, numbers = _numbers(lay)
    if len(numbers) < LEAST_ORDERS:
        return 0.0
    col, row = spectrum.at(numbers).T
    return float(spectrum.nearby[row, col].mean())


def _line(spectrum: _Spectrum, lay: Lay, order: tuple[int, int]) -> Wave | None:
    """Return the line of an order, if there is one to be seen."""
    number = np.array(order) @ np.linalg.inv(lay.steps.T)
    if np.abs(number).max() >= NYQUIST:
        return None
    col, row = spectrum.at(number)
    around = spectrum.power[row - 1 : row + 2, col - 1 : col + 2]
    below, beside = np.unravel_index(np.argmax(around), around.shape)
    row, col = row - 1 + below, col - 1 + beside
    clear = float(spectrum.above[row, col])
    if clear <= 0:
        return None
    # Where the window is about the middle, the phase there is the same all over a line.
    return Wave(_summit(spectrum, int(col), int(row)), clear, float(spectrum.phase[row, col]))


def _centre(
    size: tuple[int, ...], lay: Lay, waves: dict[tuple[int, int], Wave]
) -> tuple[tuple[float, float], _Numbers]:
    """Return the (down, right) of a lens near the middle, where the lines are in step as borders' are, and how far."""
    from scipy.optimize import minimize

    numbers = np.array(list(waves)) @ np.linalg.inv(lay.steps.T)
    phases = np.array([wave.phase for wave in waves.values()])
    signs = np.array([_sign(lay.lattice, order) for order in waves])

    def in_step(part: _Numbers) -> _Numbers:
        step: _Numbers = signs * np.cos(phases + 2 * math.pi * (numbers @ (part @ lay.steps)))
        return step

    grid = np.stack(np.meshgrid(*[np.arange(32) / 32 - 0.5] * 2), axis=-1).reshape(-1, 2)
    best = max(grid, key=lambda part: float(in_step(part).sum()))
    found = minimize(lambda part: -in_step(part).sum(), best, method="Nelder-Mead", options={"xatol": 1e-5})
    right, down = np.array(size[::-1]) / 2 + found.x @ lay.steps
    return (float(down), float(right)), in_step(found.x)


@cache
def _sign(lattice: Lattice, order: tuple[int, int]) -> float:
    """Return the sign of a wave, counted from a lens's centre, in what is low on the borders between lenses."""
    parts = np.stack(np.meshgrid(*[(np.arange(48) + 0.5) / 48] * 2), axis=-1)
    steps = Lay(lattice, 1.0, CELLS[lattice].row_pitch, 0.0).steps
    lenses = np.array(list(product((-1, 0, 1, 2), repeat=2))) @ steps
    away = np.sort(np.linalg.norm((parts @ steps)[:, :, np.newaxis] - lenses, axis=-1), axis=-1)
    borders = np.exp(-(((away[..., 1] - away[..., 0]) / 0.1) ** 2))
    return -float(np.sign((borders * np.cos(2 * math.pi * (parts @ np.array(order)))).sum()))
