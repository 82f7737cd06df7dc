"""Linear light to sRGB codes."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OpenImageIO import FLOAT, ImageBuf, ImageBufAlgo

from worker.errors import OutputError

LINEAR = "lin_rec709_scene"
SRGB = "srgb_rec709_scene"
_CONFIG = "ocio://default"
"""The colour configuration inside OpenImageIO, whatever $OCIO says here."""

_CODES = {8: np.uint8, 10: np.uint16, 16: np.uint16}


def srgb_codes(linear: NDArray[np.floating[Any]], *, bits: int = 8) -> NDArray[Any]:
    """Return the sRGB codes (IEC 61966-2-1) of linear light.

    Parameters
    ----------
    linear
        `(rows, cols, 3)`, floating, Rec. 709 primaries, 1 = white. Below 0 becomes black, above 1 white, and what is
        not a number black.
    bits
        8, 10 or 16.

    Returns
    -------
    NDArray
        `(rows, cols, 3)`, uint8, or uint16 for more than 8 bits.

    Raises
    ------
    OutputError
        If `bits` is neither, or OpenImageIO cannot convert.

    Examples
    --------
    >>> srgb_codes(np.full((1, 1, 3), 0.5, dtype=np.float32))
    array([[[188, 188, 188]]], dtype=uint8)
    """
    if bits not in _CODES:
        raise OutputError(f"expected codes of 8, 10 or 16 bits, got {bits}")
    if linear.dtype == np.float16:
        # There are only so many half floats: each is converted once, and a sheet is looked up 20 times as quickly.
        found: NDArray[Any] = _codes_of_halves(bits)[linear.view(np.uint16)]
        return found
    return _converted(linear, bits)


@lru_cache
def _codes_of_halves(bits: int) -> NDArray[Any]:
    """Return the code of every half float, by its bits as a whole number."""
    halves = np.arange(2**16, dtype=np.uint16).view(np.float16).reshape(1, -1, 1)
    return _converted(np.repeat(halves, 3, axis=2), bits)[0, :, 0]


def _converted(linear: NDArray[np.floating[Any]], bits: int) -> NDArray[Any]:
    white = 2**bits - 1
    in_range = np.clip(np.nan_to_num(linear.astype(np.float32, order="C"), nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    converted = ImageBufAlgo.colorconvert(ImageBuf(in_range), LINEAR, SRGB, colorconfig=_CONFIG)
    if converted.has_error:
        raise OutputError(f"cannot convert to sRGB: {converted.geterror()}")
    encoded = np.clip(np.asarray(converted.get_pixels(FLOAT), dtype=np.float32), 0.0, 1.0)
    codes: NDArray[Any] = np.rint(encoded * white).astype(_CODES[bits])
    return codes
