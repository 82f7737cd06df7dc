"""A picture of either kind as 8-bit sRGB codes: what `lippmann.lightfield.quality.compare` compares."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from worker.images.colour import srgb_codes
from worker.images.read import read_codes_8, read_rgb

MASTER, SHOWN = ".exr", ".png"
"""Suffixes of linear light and of sRGB codes."""


def picture_codes(path: Path) -> NDArray[np.uint8]:
    """Return an EXR's linear light as sRGB codes, or a PNG's codes as they are, `(rows, cols, 3)`.

    Raises
    ------
    ArtifactMissing, ArtifactBroken
        If the file is not there, not whole, or does not have the three channels.
    OutputError
        If it cannot be converted.
    """
    return srgb_codes(read_rgb(path, np.float32)) if path.suffix.lower() == MASTER else read_codes_8(path)
