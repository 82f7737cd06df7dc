"""Another size."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import OutputError
from lippmann.job.optics.viewing import Filter
from tests.unit.worker.images.pictures import noise
from worker.images.resize import resize

FILTERS: tuple[Filter, ...] = ("box", "triangle", "mitchell", "lanczos3")


@given(
    filter_name=st.sampled_from(FILTERS),
    old=st.tuples(st.integers(1, 30), st.integers(1, 30)),
    new=st.tuples(st.integers(1, 60), st.integers(1, 60)),
)
def test_even_light_stays_even(filter_name: Filter, old: tuple[int, int], new: tuple[int, int]) -> None:
    resized = resize(np.full((*old, 3), 0.25, np.float16), rows=new[0], cols=new[1], filter_name=filter_name)
    assert resized.shape == (*new, 3)
    # The weights of 900 pixels, added in single precision, come to 1 within 1.2e-5 (measured).
    np.testing.assert_allclose(resized, 0.25, rtol=1e-4)


@given(factor=st.integers(1, 5))
def test_a_box_by_a_whole_factor_repeats_pixels(factor: int) -> None:
    light = noise(6, 5, np.float32)
    resized = resize(light, rows=6 * factor, cols=5 * factor, filter_name="box")
    np.testing.assert_allclose(resized, light.repeat(factor, axis=0).repeat(factor, axis=1), rtol=1e-6)


@pytest.mark.parametrize("filter_name", FILTERS)
def test_the_picture_neither_moves_nor_turns(filter_name: Filter) -> None:
    light = np.zeros((9, 13, 3), np.float32)
    light[2, 10] = 1.0
    resized = resize(light, rows=45, cols=65, filter_name=filter_name)
    weights = np.clip(resized[:, :, 0], 0, None)
    row, col = (weights * np.indices(weights.shape)).sum(axis=(1, 2)) / weights.sum()
    assert row == pytest.approx(2 * 5 + 2, abs=0.05)
    assert col == pytest.approx(10 * 5 + 2, abs=0.05)


def test_no_size_is_refused() -> None:
    with pytest.raises(OutputError, match="at least 1 x 1 px, got 0 x 5"):
        resize(noise(4, 4), rows=0, cols=5)


def test_an_unknown_filter_is_refused() -> None:
    with pytest.raises(OutputError, match="cannot resize"):
        resize(noise(4, 4), rows=8, cols=8, filter_name="magic")  # type: ignore[arg-type]  # what a caller might do
