"""Planar 8-bit YUV 4:2:0 without a header, frame after frame: all of Y, all of Cb, all of Cr.

R'G'B' to Y'CbCr by ITU-R BT.709-6, 3.2 to 3.4, in video range: Y' = 16 + 219 Y, Cb = 128 + 224 (B - Y) / 1.8556, Cr =
128 + 224 (R - Y) / 1.5748, Y = 0.2126 R + 0.7152 G + 0.0722 B, rounded to the nearest code. Chroma is the mean of 2 x 2
pixels, so it lies in their middle; with an even number of pixels a lens it never mixes two lenses.
"""

from __future__ import annotations

from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import OutputError
from lippmann.lightfield.quality.luminance import WEIGHTS

RED, GREEN, BLUE = WEIGHTS.tolist()
_TO_YCBCR = np.array(
    [
        [219 * RED, 219 * GREEN, 219 * BLUE],
        [-224 * RED / 1.8556, -224 * GREEN / 1.8556, 224 * (1 - BLUE) / 1.8556],
        [224 * (1 - RED) / 1.5748, -224 * GREEN / 1.5748, -224 * BLUE / 1.5748],
    ],
    dtype=np.float32,
)
_ROWS_AT_ONCE = 256
"""The rows that are converted together, an even number; they need some ten MB beside the codes."""


def write_frame(file: BinaryIO, codes: NDArray[np.uint8]) -> None:
    """Append a frame to an open file.

    Parameters
    ----------
    file
        A file of frames of the same size.
    codes
        R'G'B' `(rows, cols, 3)`, both sides even.

    Raises
    ------
    OutputError
        If it has another shape or type.
    """
    for plane in planes(codes):
        file.write(plane.data)


def planes(codes: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]:
    """Return the Y, Cb and Cr of a frame, `(rows, cols)` and twice `(rows / 2, cols / 2)`; see `write_frame`."""
    rows, cols = codes.shape[:2]
    if codes.ndim != 3 or codes.shape[2] != 3 or codes.dtype != np.uint8 or rows % 2 or cols % 2 or not codes.size:
        raise OutputError(f"expected codes (rows, cols, 3), even sides, for 4:2:0, got {codes.dtype} {codes.shape}")
    luma = np.empty((rows, cols), dtype=np.uint8)
    chroma = np.empty((2, rows // 2, cols // 2), dtype=np.uint8)
    to_luma, to_chroma = _TO_YCBCR[0] / 255, _TO_YCBCR[1:] / (4 * 255)
    for start in range(0, rows, _ROWS_AT_ONCE):
        part = codes[start : start + _ROWS_AT_ONCE].astype(np.float32)
        luma[start : start + len(part)] = np.rint(part @ to_luma + 16)
        summed = part[0::2, 0::2] + part[1::2, 0::2] + part[0::2, 1::2] + part[1::2, 1::2]
        half = slice(start // 2, start // 2 + len(summed))
        chroma[:, half] = np.rint(summed @ to_chroma.T + 128).transpose(2, 0, 1)
    return luma, chroma[0], chroma[1]
