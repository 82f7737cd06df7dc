"""Fits of measured times, and what is read of POV-Ray's words."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.experiments.fits import line_through
from lippmann.experiments.timing import read_samples

SIZES = [16e4, 64e4, 256e4, 576e4]


@given(constant=st.floats(0.01, 10), slope=st.floats(1e-7, 1e-4))
def test_points_on_a_line_give_that_line(constant: float, slope: float) -> None:
    line = line_through(SIZES, [constant + slope * size for size in SIZES])
    assert (line.constant, line.slope) == pytest.approx((constant, slope), rel=1e-4)
    assert line.largest_deviation < 1e-6


def test_the_largest_deviation_is_that_of_the_point_farthest_off() -> None:
    times = [1.0 + 1e-5 * size for size in SIZES]
    times[2] *= 1.06
    line = line_through(SIZES, times)
    assert 0.02 < line.largest_deviation < 0.06
    off = [abs(time / line.at(size) - 1) for size, time in zip(SIZES, times, strict=True)]
    assert line.largest_deviation == pytest.approx(max(off))


def test_time_that_grows_with_the_square_is_seen_not_to_be_a_line() -> None:
    assert line_through(SIZES, [1e-12 * size**2 for size in SIZES]).largest_deviation > 0.5


def test_samples_that_antialiasing_adds_count_with_one_a_pixel() -> None:
    assert read_samples("a\nPixels:             1920   Samples:           16146   Smpls/Pxl: 8.41\n") == 18066
    assert read_samples("Pixels:             1920   Samples:               0   Smpls/Pxl: 0.00") == 1920
    assert read_samples("nothing") == 0
