"""Linear light to sRGB codes, as videos carry them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray


def srgb_codes(linear: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    """Return the 8-bit sRGB codes of linear light.

    Light is rounded to half floats first, of which every one has its code in a table: exact to one code and as fast as
    copying.

    Parameters
    ----------
    linear
        Any shape, floating, 1 = white. Below 0 becomes black, above 1 white, and what is not a number black.

    Returns
    -------
    NDArray
        uint8, of the same shape.

    References
    ----------
    IEC 61966-2-1:1999, section 5.2.
    """
    half = np.clip(linear, -1.0, 2.0).astype(np.float16)
    codes: NDArray[np.uint8] = _code_of_half()[half.view(np.uint16)]
    return codes


@cache
def _code_of_half() -> NDArray[np.uint8]:
    halves = np.arange(0x10000, dtype=np.uint16).view(np.float16)
    light = np.clip(np.nan_to_num(halves.astype(np.float64), nan=0.0), 0.0, 1.0)
    encoded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    codes: NDArray[np.uint8] = np.rint(255 * encoded).astype(np.uint8)
    return codes
