"""Convert pictures for the service and for comparisons: sRGB codes, or bytes of a PNG or WebP.

The functions may be called from any number of threads.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.job.viewing import Filter
from worker.images.colour import srgb_codes
from worker.images.colour_space import file_colour_space
from worker.images.imported import read_imported
from worker.images.read import read_codes_8, read_rgb
from worker.images.resize import resize
from worker.images.write import encoded_png, encoded_webp

MASTER, SHOWN = ".exr", ".png"
"""The suffixes of files with linear light and with sRGB codes."""


def picture_codes(path: Path, *, linear: bool = False) -> NDArray[np.uint8]:
    """Return the sRGB codes of an EXR or a PNG, `(rows, cols, 3)`.

    The codes of a PNG in sRGB are returned as they are stored. Those of one in another colour space are decoded and
    encoded again.

    Parameters
    ----------
    path
        The EXR or PNG.
    linear
        Read the codes of a PNG as linear light, whatever colour space the file names.

    Raises
    ------
    ArtifactMissing, ArtifactBroken
        If the file is not there, not whole, or does not have the three channels.
    OutputError
        If it cannot be converted.
    """
    if path.suffix.lower() == MASTER:
        return srgb_codes(read_rgb(path, np.float32))
    if not linear and file_colour_space(path).name == "sRGB":
        return read_codes_8(path)
    return srgb_codes(read_imported(path, linear=linear))


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
    linear: NDArray[np.floating[Any]], *, as_format: Literal["png", "webp"], scale: int, filter_name: Filter
) -> bytes:
    """Return linear light as an sRGB file of 8 bits.

    Parameters
    ----------
    linear
        `(rows, cols, 3)`.
    as_format
        PNG, or WebP, which is lossy and smaller.
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
    encoded = encoded_png(linear, bits=8) if as_format == "png" else encoded_webp(linear)
    with encoded as file:
        return file.read()
