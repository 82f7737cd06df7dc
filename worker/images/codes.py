"""A picture of either kind as 8-bit sRGB codes: what `lippmann.lightfield.quality.compare` compares."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from worker.images.colour import srgb_codes
from worker.images.colour_space import file_colour_space
from worker.images.imported import read_foreign
from worker.images.read import read_codes_8, read_rgb

MASTER, SHOWN = ".exr", ".png"
"""Suffixes of linear light and of sRGB codes."""


def picture_codes(path: Path, *, linear: bool = False) -> NDArray[np.uint8]:
    """Return the sRGB codes of an EXR or a PNG, `(rows, cols, 3)`.

    The codes of a PNG in sRGB are returned as they are stored. Those of one in another colour space are decoded and
    encoded again.

    Parameters
    ----------
    path
        The EXR or PNG.
    linear
        Take the codes of a PNG for linear light, whatever the file says.

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
    return srgb_codes(read_foreign(path, linear=linear))
