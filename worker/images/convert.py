"""Convert pictures for the service: the bytes of a PNG, WebP or EXR.

The functions may be called from any number of threads.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from lippmann.job.optics.viewing import Filter, PictureFormat
from worker.images.read import read_rgb
from worker.images.resize import resize
from worker.images.write import encoded_exr, encoded_png, encoded_webp

MASTER, SHOWN = ".exr", ".png"
"""The suffixes of files with linear light and with sRGB codes."""


def png(path: Path, *, bits: int = 8) -> bytes:
    """Return a linear EXR as an sRGB PNG.

    Parameters
    ----------
    path
        The EXR file.
    bits
        8 or 16 a channel.

    Raises
    ------
    ArtifactMissing, ArtifactBroken
        If the file is not there or not whole.
    OutputError
        If it cannot be converted, or `bits` is neither 8 nor 16.
    """
    with encoded_png(read_rgb(path, np.float32), bits=bits) as file:
        return file.read()


def encoded_picture(
    linear: NDArray[np.floating[Any]], *, as_format: PictureFormat, scale: int, filter_name: Filter
) -> bytes:
    """Return linear light as an sRGB file of 8 bits, or as it is.

    Parameters
    ----------
    linear
        `(rows, cols, 3)`.
    as_format
        PNG; WebP, which is lossy and smaller; or EXR, linear light of single precision.
    scale
        The scale in both directions, in linear light.
    filter_name
        The filter that scales the picture.

    Raises
    ------
    OutputError
        If it cannot be converted.
    """
    if scale > 1:
        rows, cols = linear.shape[:2]
        linear = resize(linear, rows=rows * scale, cols=cols * scale, filter_name=filter_name)
    with _encoded(linear, as_format) as file:
        return file.read()


def _encoded(linear: NDArray[np.floating[Any]], as_format: PictureFormat) -> AbstractContextManager[BinaryIO]:
    if as_format == "exr":
        return encoded_exr(linear)
    return encoded_png(linear, bits=8) if as_format == "png" else encoded_webp(linear)
