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
from lippmann.lightfield.calibrate.borders import breaks_of, refined
from lippmann.lightfield.calibrate.evidence import of_edges
from lippmann.lightfield.calibrate.interference import Interference, interference
from lippmann.lightfield.calibrate.periods import LENSES_ACROSS
from lippmann.lightfield.calibrate.phases import Lay, Measured, Wave, fitted_lay
from lippmann.lightfield.calibrate.spectrum import NYQUIST, Spectrum, spectrum_of

ORDERS: dict[Lattice, tuple[tuple[int, int], ...]] = {
    "square": tuple(order for i in range(1, 7) for order in ((i, 0), (0, i))),
    "hexagonal": ((1, 0), (0, 1), (1, 1), (2, 1), (1, 2), (1, -1), (2, 0), (0, 2), (2, 2)),
}
"""Lines, in waves dual to the steps."""

NEARLY = 0.75
"""The share of the best agreement with which a larger pitch is preferred."""

HIGHEST_ORDER = 6
"""The highest order as which a line on an axis is tried."""

LEAST_ORDERS = 4
"""Lines that must be seen at least; two place a lattice anywhere."""

MOST_TRIED, HARDLY = 24, 0.02
"""Lattices that are measured, and by how much they differ at least."""

OFF_LINE = 0.4
"""The distance from its place, in squares of the spectrum, from which a line is that of something else."""

SKEW_DEG = 0.7
"""The largest difference of the rotations of the two axes, degrees."""

UNLIKE: dict[Lattice, float] = {"square": 0.01, "hexagonal": 0.08}
"""The largest relative difference of the row pitch from that of square pixels, which hexagons on whole pixels have."""

NEAR = 0.03
"""The largest relative difference of a pitch from the one that is known roughly."""

BLOCK_PX = 8.0
"""The side of a block of JPEG (ITU-T T.81, A.1): lines of that period are no evidence of lenses."""

STEP_AT_BORDERS, STEP_BY_PITCH, BOTH_STEPS, EVEN_STEPS = 1.2, 0.9, 1.6, 0.7
"""The least steps at the borders of cells, by those inside and by the difference of neighbouring cells, the least
product of both, and the least steps at a class of borders; see `borders.Breaks`."""

STEP_EVERYWHERE, STEP_ALONG = 1.15, 0.55
"""The least steps at the borders of cells in most parts of a picture, and at every place along them; see `borders`."""

ALIKE_INSIDE = 0.75
"""The least steps at one place inside the cells, by those at another: 0.9 to 1 for lenses, 0.3 to 0.5 at twice the
pitch, as measured with pictures like those of `tests.benchmarks.find_lenses`."""

AS_CLEAR = 0.6
"""The share of the strength of the chosen lattice from which another is its rival."""

LEAST_AGREEMENT = 0.1
"""The agreement below which nothing more is asked of a lattice."""

_Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class Comb:
    """The lattices that are found by their lines."""

    lenses: Measured | None
    """The lattice of the lenses; its agreement is the mean contrast and phase coherence of its lines."""
    rival: Measured | None
    """The next best that is not the same with every second or third line, or with lines between."""
    grid: Measured | None
    """The clearest grid that is not that of lenses: what is shown goes on across it, or it may be of JPEG's blocks."""
    disturbed: Interference | None = None
    """The reason why the pitch of the lenses is uncertain."""


def measure_comb(tone: NDArray[np.float32], *, near_px: float | None = None) -> Comb:
    """Find the lattice in a picture by its spectral lines.

    Parameters
    ----------
    tone
        `(rows, cols)`; see `evidence.tone_of`.
    near_px
        A pitch that is known roughly: no other is looked for.
    """
    whole = spectrum_of(of_edges(tone))
    blocks = _blocks(whole)
    spectrum = whole if blocks is None else whole.without(_block_lines())
    measured = [_measured(spectrum, lay) for lay in _distinct(spectrum, near_px)]
    known = [one for one in measured if one is not None]
    lenses = [one for one in known if one.agreement > LEAST_AGREEMENT and _breaks_off(tone, one)]
    others = [one for one in (blocks, *known) if one is not None and one not in lenses]
    grid = max(others, key=lambda one: one.agreement, default=None)
    if not lenses:
        return Comb(None, None, grid)
    best = max(lenses, key=lambda one: one.agreement)
    related = [one for one in lenses if one is best or _is_multiple(one, best)]
    # At twice the pitch, every second border is inside a cell.
    chosen = max(related, key=lambda one: breaks_of(tone, one).than_inside)
    fine = refined(tone, chosen)
    found = breaks_of(tone, fine)
    if found.everywhere < STEP_EVERYWHERE or found.along < STEP_ALONG:
        return Comb(None, None, fine)
    rivals = [
        one
        for one in lenses
        if not _are_related(one.lay, fine.lay) and breaks_of(tone, one).strength >= AS_CLEAR * found.strength
    ]
    clearer = [one for one in known if one not in lenses and one.agreement > fine.agreement]
    disturbed = interference(fine, _lines(spectrum, fine.lay), clearer, spectrum.size)
    return Comb(fine, max(rivals, key=lambda one: one.agreement, default=None), grid, disturbed)


def _blocks(spectrum: Spectrum) -> Measured | None:
    """Return the grid of JPEG's blocks if it can be seen along both axes."""
    for axis in (0, 1):
        numbers = np.zeros((3, 2))
        numbers[:, axis] = np.arange(1, 4) / BLOCK_PX
        col, row = spectrum.at(numbers).T
        if not spectrum.nearby[row, col].mean() > LEAST_AGREEMENT:
            return None
    return _measured(spectrum, Lay("square", BLOCK_PX, BLOCK_PX, 0.0))


def _block_lines() -> Iterator[_Numbers]:
    """Yield the waves of the borders of JPEG's blocks, which are those of many video codecs too."""
    most = math.ceil(NYQUIST * BLOCK_PX)
    for order in product(range(-most, most + 1), repeat=2):
        if order != (0, 0):
            yield np.array(order) / BLOCK_PX


def _breaks_off(tone: NDArray[np.float32], measured: Measured) -> bool:
    """Return whether what is shown breaks off at the borders of a lattice, as it does between lenses."""
    found = breaks_of(tone, measured)
    return (
        found.than_inside >= STEP_AT_BORDERS
        and found.than_a_pitch >= STEP_BY_PITCH
        and found.strength >= BOTH_STEPS
        and found.evenness >= EVEN_STEPS
        and found.alike >= ALIKE_INSIDE
    )


def _are_related(lay: Lay, other: Lay) -> bool:
    """Return whether one pitch is the other, or small whole numbers of it fit into small whole numbers of the other."""
    ratio = lay.pitch_px / other.pitch_px
    return any(abs(ratio * below / above - 1) < HARDLY for above, below in product(range(1, 6), repeat=2))


def _is_multiple(measured: Measured, best: Measured) -> bool:
    """Return whether the lines of the best are every second, third .. of these, and nearly all of these are there."""
    ratio = measured.lay.pitch_px / best.lay.pitch_px
    return (
        measured.lay.lattice == best.lay.lattice
        and round(ratio) >= 2
        and measured.agreement >= NEARLY * best.agreement
        and abs(ratio - round(ratio)) < HARDLY * ratio
    )


def _distinct(spectrum: Spectrum, near_px: float | None) -> list[Lay]:
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


def _measured(spectrum: Spectrum, rough: Lay) -> Measured | None:
    """Return a lattice measured at its lines; how far it is to be believed: those in step, by how clear they are."""
    waves = {order: wave for order in ORDERS[rough.lattice] if (wave := _line(spectrum, rough, order)) is not None}
    if len(waves) < LEAST_ORDERS:
        return None
    lay = fitted_lay(rough, tuple(waves), list(waves.values()))
    waves = {order: wave for order, wave in waves.items() if _off_line(spectrum, lay, order, wave) < OFF_LINE}
    if len(waves) < LEAST_ORDERS:
        return None
    lay = fitted_lay(lay, tuple(waves), list(waves.values()))
    if abs(lay.row_pitch_px / (lay.pitch_px * CELLS[lay.lattice].row_pitch) - 1) > UNLIKE[lay.lattice]:
        return None
    centre, in_step = _centre(spectrum.middle_px, lay, waves)
    orders, _ = _numbers(spectrum, lay)
    clear = sum(wave.agreement * step for wave, step in zip(waves.values(), in_step, strict=True))
    return Measured(lay, centre, max(0.0, float(clear)) / max(1, len(orders)))


def _lines(spectrum: Spectrum, lay: Lay) -> dict[tuple[int, int], Wave]:
    """Return the lines within a square of the spectrum of where a lattice has them, by their orders."""
    found = ((order, _line(spectrum, lay, order)) for order in ORDERS[lay.lattice])
    return {order: wave for order, wave in found if wave is not None and _off_line(spectrum, lay, order, wave) < 1}


def _off_line(spectrum: Spectrum, lay: Lay, order: tuple[int, int], wave: Wave) -> float:
    """Return how far a line is from where the lattice has it, in squares of the spectrum."""
    return float(np.abs((np.array(order) @ np.linalg.inv(lay.steps.T) - wave.number) * spectrum.size).max())


def _line(spectrum: Spectrum, lay: Lay, order: tuple[int, int]) -> Wave | None:
    return spectrum.line(np.array(order) @ np.linalg.inv(lay.steps.T))


def _lattices(spectrum: Spectrum, near_px: float | None) -> Iterator[Lay]:
    """Yield lattices that have a line on each axis where the spectrum has a peak."""
    level, upright = (spectrum.peaks(axis) for axis in (0, 1))
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


def _numbers(spectrum: Spectrum, lay: Lay) -> tuple[NDArray[np.intp], _Numbers]:
    """Return the orders of a lattice at which the spectrum could have lines, and their waves."""
    orders = np.array(ORDERS[lay.lattice])
    numbers = orders @ np.linalg.inv(lay.steps.T)
    room = spectrum.has_room(numbers)
    return orders[room], numbers[room]


def _score(spectrum: Spectrum, lay: Lay) -> float:
    _, numbers = _numbers(spectrum, lay)
    if len(numbers) < LEAST_ORDERS:
        return 0.0
    col, row = spectrum.at(numbers).T
    return float(spectrum.nearby[row, col].mean())


def _centre(middle_px: _Numbers, lay: Lay, waves: dict[tuple[int, int], Wave]) -> tuple[tuple[float, float], _Numbers]:
    """Return the (down, right) of a lens near the middle, where the lines are in step as borders' are, and how far."""
    from scipy.optimize import minimize

    numbers = np.array(list(waves)) @ np.linalg.inv(lay.steps.T)
    phases = np.array([wave.phase for wave in waves.values()])
    signs = np.array([_sign(lay.lattice, order) for order in waves])

    turns = 2 * math.pi * (lay.steps @ numbers.T)

    def in_step(part: _Numbers) -> _Numbers:
        step: _Numbers = signs * np.cos(phases + part @ turns)
        return step

    grid = np.stack(np.meshgrid(*[np.arange(32) / 32 - 0.5] * 2), axis=-1).reshape(-1, 2)
    best = grid[np.argmax(in_step(grid).sum(axis=1))]
    found = minimize(lambda part: -in_step(part).sum(), best, method="Nelder-Mead", options={"xatol": 1e-5})
    right, down = middle_px + found.x @ lay.steps
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
