"""Linear light to sRGB codes and back; depths as colours."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import OutputError

LINEAR = "lin_rec709_scene"
SRGB = "srgb_rec709_scene"
"""The names of the colour spaces in OpenImageIO."""
_CODES = {8: np.uint8, 10: np.uint16, 16: np.uint16}


def srgb_codes(linear: NDArray[np.floating[Any]], *, bits: int = 8) -> NDArray[Any]:
    """Return the sRGB codes (IEC 61966-2-1) of linear light.

    Parameters
    ----------
    linear
        `(rows, cols, 3)`, floating, Rec. 709 primaries, 1 = white. Values below 0 become black,
        values above 1 white, and NaN black.
    bits
        8, 10 or 16.

    Returns
    -------
    NDArray
        `(rows, cols, 3)`, uint8, or uint16 for more than 8 bits.

    Raises
    ------
    OutputError
        If `bits` has another value.

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


def decoded_srgb(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the linear light of sRGB values (IEC 61966-2-1, section 5.3).

    Parameters
    ----------
    encoded
        Values from 0 to 1, any shape.

    Examples
    --------
    >>> decoded_srgb(np.array([0.0, 0.5, 1.0])).round(3).tolist()
    [0.0, 0.214, 1.0]
    """
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def linear_light(codes: NDArray[Any]) -> NDArray[np.float16]:
    """Return the linear light of sRGB codes, in half floats; the inverse of `srgb_codes` of 8 bits.

    Parameters
    ----------
    codes
        `(rows, cols, channel)`, uint8 or uint16. Half floats distinguish neighbouring 16-bit codes only in shadows.

    Examples
    --------
    >>> linear_light(np.array([[[0, 188, 255]]], dtype=np.uint8)).round(3)
    array([[[0.   , 0.503, 1.   ]]], dtype=float16)
    """
    if codes.dtype not in (np.uint8, np.uint16):
        raise OutputError(f"expected codes of 8 or 16 bits, got {codes.dtype}")
    found: NDArray[np.float16] = _light_of_codes(8 * codes.dtype.itemsize)[codes]
    return found


@lru_cache
def _light_of_codes(bits: int) -> NDArray[np.float16]:
    """Return the linear light of every code."""
    halves: NDArray[np.float16] = decoded_srgb(np.arange(2**bits) / (2**bits - 1)).astype(np.float16)
    return halves


@lru_cache
def _codes_of_halves(bits: int) -> NDArray[Any]:
    """Return the code of every half float, by its bits as a whole number."""
    halves = np.arange(2**16, dtype=np.uint16).view(np.float16).reshape(1, -1, 1)
    return _converted(np.repeat(halves, 3, axis=2), bits)[0, :, 0]


def _converted(linear: NDArray[np.floating[Any]], bits: int) -> NDArray[Any]:
    light = np.nan_to_num(linear.astype(np.float32), nan=0.0, posinf=1.0, neginf=0.0)
    np.clip(light, 0.0, 1.0, out=light)
    # IEC 61966-2-1, section 5.2.
    encoded = np.where(light <= np.float32(0.0031308), light * np.float32(12.92), _power_law(light))
    codes: NDArray[Any] = np.rint(encoded * np.float32(2**bits - 1)).astype(_CODES[bits])
    return codes


def _power_law(light: NDArray[np.float32]) -> NDArray[np.float32]:
    return light ** np.float32(1 / 2.4) * np.float32(1.055) - np.float32(0.055)


BEHIND = ((0.55, 0.55, 0.55), (0.10, 0.35, 0.75), (0.03, 0.10, 0.45))
IN_FRONT = ((0.55, 0.55, 0.55), (0.95, 0.45, 0.05), (0.60, 0.02, 0.02))
"""Colours in linear light, from the plane of the display to the farthest depth: grey to blue, grey to red."""


def depth_colours(s_mm: NDArray[np.float32], *, deepest_mm: float) -> NDArray[np.float32]:
    """Return depths `(row, col)` as linear light `(row, col, 3)`; black where the depth is NaN.

    Parameters
    ----------
    s_mm
        Depths at the display, positive in front.
    deepest_mm
        The depth, on either side, that has the last colour; larger depths have it too.
    """
    part = np.clip(np.abs(np.nan_to_num(s_mm)) / deepest_mm, 0, 1) * (len(BEHIND) - 1)
    steps = np.arange(len(BEHIND))
    sides = [
        np.stack([np.interp(part, steps, channel) for channel in zip(*colours, strict=True)], axis=-1)
        for colours in (BEHIND, IN_FRONT)
    ]
    light = np.where((s_mm > 0)[..., np.newaxis], sides[1], sides[0])
    return np.where(np.isnan(s_mm)[..., np.newaxis], 0, light).astype(np.float32)


def deepest_shown_mm(s_mm: NDArray[np.float32]) -> float:
    """Return the 99th percentile of abs(s) of the pixels with a depth; 1 mm if no pixel has one."""
    there = np.abs(s_mm[np.isfinite(s_mm)])
    return max(float(np.quantile(there, 0.99)), 1e-3) if there.size else 1.0
