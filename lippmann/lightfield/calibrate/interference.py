"""Check a pitch against grids that are clearer than the lenses, as the blocks of JPEG are in a picture that was scaled.

Lines of such a grid lie beside lines of the lenses where small whole numbers of both periods are nearly equal, and draw
the pitch to the one at which they are equal: lenses of 20.06 px are measured as 20.00 px among blocks of 12 px, after
strong compression. So the pitch must also come out of the lines that no clearer grid has.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.kinds import CELLS
from lippmann.lightfield.calibrate.phases import Lay, Measured, Wave, fitted_lay

APART = 1.5
"""The distance of a line from one of another grid, in squares of the spectrum, from which it is not disturbed."""

CLEAN_LINES = 2
"""The least number of undisturbed lines along an axis by which the pitch along it is checked."""

DIFFERENT = 0.075
"""The largest difference of the pitch along an axis by the undisturbed lines, in pitches by the lenses along the
shorter side: up to 0.06 where the pitch is right, 0.15 where it is not, as measured with pictures like those of
`tests.benchmarks.find_lenses`."""

SAME = 0.001
"""The relative difference up to which a whole part of the pitch is the same lattice, of which some lines are there."""

AS_CLEAR = 0.5
"""The least agreement of lenses without undisturbed lines, by that of the clearest grid: 0.8 to 1 where the pitch is
right, 0.3 where it is not."""


@dataclass(frozen=True)
class Interference:
    """Another grid that makes a pitch uncertain."""

    grid: Measured
    """The clearest such grid."""
    axis: int = 0
    """The axis along which it is uncertain: 0 for the pitch, 1 for the row pitch."""
    pitch_px: float | None = None
    """The pitch along the axis by the lines that no clearer grid has; None if there are too few of them."""


def interference(
    lenses: Measured, waves: Mapping[tuple[int, int], Wave], clearer: Sequence[Measured], size: NDArray[Any]
) -> Interference | None:
    """Return what makes the pitch of lenses uncertain; None if nothing does.

    Parameters
    ----------
    lenses
        The lattice of the lenses.
    waves
        Its lines, by their orders.
    clearer
        Grids of a higher agreement that are not of lenses.
    size
        The (cols, rows) of the spectrum.
    """
    others = [one for one in clearer if not _is_whole_part(one.lay, lenses.lay)]
    if not others:
        return None
    grid = max(others, key=lambda one: one.agreement)
    clean = {
        order: wave for order, wave in waves.items() if not any(_is_line(wave, other.lay, size) for other in others)
    }
    counts = [sum(_is_along(axis, order, lenses.lay) for order in clean) for axis in (0, 1)]
    if any(count >= CLEAN_LINES for count in counts):
        by_clean = _pitches_px(fitted_lay(lenses.lay, tuple(clean), list(clean.values())))
        for axis, (found_px, pitch_px) in enumerate(zip(_pitches_px(lenses.lay), by_clean, strict=True)):
            lenses_across = float(size.min()) / found_px
            if counts[axis] >= CLEAN_LINES and abs(pitch_px / found_px - 1) * lenses_across > DIFFERENT:
                return Interference(grid, axis, pitch_px)
    if min(counts) >= CLEAN_LINES or lenses.agreement >= AS_CLEAR * grid.agreement:
        return None
    return Interference(grid, int(np.argmin(counts)))


def _pitches_px(lay: Lay) -> tuple[float, float]:
    return lay.pitch_px, lay.row_pitch_px


def _is_along(axis: int, order: tuple[int, int], lay: Lay) -> bool:
    """Return whether a line tells the pitch (axis 0) or the row pitch (axis 1)."""
    return (order[0] if axis == 0 else order[1] - CELLS[lay.lattice].row_shift * order[0]) != 0


def _is_whole_part(grid: Lay, lenses: Lay) -> bool:
    """Return whether the periods of a grid are whole parts of those of the lenses."""
    ratios = [pitch_px / period_px for pitch_px, period_px in zip(_pitches_px(lenses), _pitches_px(grid), strict=True)]
    return all(round(ratio) >= 1 and abs(ratio / round(ratio) - 1) < SAME for ratio in ratios)


def _is_line(wave: Wave, lay: Lay, size: NDArray[Any]) -> bool:
    """Return whether a wave cannot be told from a line of a grid."""
    order = np.round(wave.number @ lay.steps.T)
    return bool(np.abs((order @ np.linalg.inv(lay.steps.T) - wave.number) * size).max() < APART)
