"""Bjøntegaard's measure: laws, and what it refuses."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lightfield.quality.rate_distortion import bd_rate

CURVE = [(1.0, 30.0), (1.9, 33.1), (4.2, 36.0), (9.0, 38.5)]


@given(factor=st.floats(0.1, 10))
def test_a_curve_of_so_many_times_the_rate_needs_so_much_more(factor: float) -> None:
    assert bd_rate(CURVE, [(factor * rate, psnr) for rate, psnr in CURVE]) == pytest.approx(factor - 1, abs=1e-9)


def test_the_two_ways_round_are_inverse() -> None:
    other = [(1.5, 31.0), (2.5, 33.0), (6.0, 37.0)]
    assert (1 + bd_rate(CURVE, other)) * (1 + bd_rate(other, CURVE)) == pytest.approx(1)


def test_of_straight_lines_the_mean_is_over_the_psnrs_that_both_reach() -> None:
    straight = [(math.exp(k), 30.0 + k) for k in range(5)]
    steeper = [(math.exp(k / 2), 30.0 + k) for k in range(5)]
    # Between 30 and 34 dB the logarithms differ by -(psnr - 30) / 2: -1 in the mean.
    assert bd_rate(straight, steeper) == pytest.approx(math.exp(-1) - 1)
    assert bd_rate(straight, steeper[2:]) == pytest.approx(math.exp(-1.5) - 1)


def test_curves_that_do_not_meet_say_nothing() -> None:
    assert math.isnan(bd_rate(CURVE, [(1.0, 40.0), (2.0, 42.0)]))


@pytest.mark.parametrize(
    ("curve", "words"),
    [
        ([(1.0, 30.0)], "at least 2 points"),
        ([(0.0, 30.0), (1.0, 31.0)], "a rate above 0"),
        ([(1.0, 30.0), (1.0, 31.0)], "rises with the rate"),
        ([(2.0, 30.0), (1.0, 31.0)], "rises with the rate"),
        ([(1.0, math.inf), (1.0, 31.0)], "finite"),
    ],
)
def test_what_is_no_curve_is_refused(curve: list[tuple[float, float]], words: str) -> None:
    with pytest.raises(LayoutError, match=words):
        bd_rate(CURVE, curve)
