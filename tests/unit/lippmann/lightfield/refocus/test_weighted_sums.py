"""The planes of a sheet in single precision."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.lightfield.refocus.weighted_sums import planes

EVERY = np.arange(2**16, dtype=np.uint16).view(np.float16)


def test_every_half_float_becomes_the_single_that_it_is() -> None:
    finite = EVERY[np.isfinite(EVERY)]
    for half in (finite, EVERY):
        found = planes(half.reshape(-1, 8, 1))
        assert found.dtype == np.float32
        np.testing.assert_array_equal(found.ravel().view(np.uint32)[~np.isnan(half)], singles(half)[~np.isnan(half)])
        np.testing.assert_array_equal(np.isnan(found.ravel()), np.isnan(half))


def singles(half: np.ndarray) -> np.ndarray:
    """Return the bits by NumPy, signs of zero among them."""
    bits: np.ndarray = half.astype(np.float32).view(np.uint32)
    return bits


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_channels_come_first_whatever_the_strides(dtype: type) -> None:
    light: np.ndarray = np.random.default_rng(1).random((10, 14, 6)).astype(dtype)[::-2, 1::3, ::2]
    found = planes(light)
    assert found.flags.c_contiguous
    assert found.dtype == np.result_type(dtype, np.float32)
    np.testing.assert_array_equal(found, np.moveaxis(light, -1, 0))


def test_no_pixels_are_no_pixels() -> None:
    assert planes(np.zeros((0, 4, 3), np.float16)).shape == (3, 0, 4)
    assert planes(np.zeros((4, 0, 3), np.float16)).shape == (3, 4, 0)
