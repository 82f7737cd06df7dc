"""The lenses at which the borders of a lattice are looked at."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from lippmann.lightfield.calibrate import borders
from lippmann.lightfield.calibrate.phases import Lay, Measured


@pytest.mark.parametrize("side_px", [1000, 32_000])
def test_lenses_are_drawn_from_all_over_the_picture_in_little_memory(side_px: int) -> None:
    measured = Measured(Lay("hexagonal", 4.0, 4.0, 3.0), (side_px / 2, side_px / 2), 1.0)
    tracemalloc.start()
    numbers = borders._lenses(measured, (side_px, side_px))
    peak_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak_bytes < 50e6
    assert len(np.unique(numbers, axis=0)) == len(numbers) == borders.LENSES
    places = side_px / 2 + numbers @ measured.lay.steps
    assert places.min() > 6
    assert places.max() < side_px - 6
    col, row = (places * 4 // side_px).astype(int).T
    counts = np.bincount(4 * row + col, minlength=16)
    assert counts.min() > borders.LENSES / 16 / 2
