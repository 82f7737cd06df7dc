"""A linear EXR as PNG bytes, for the service. Safe to call from any number of threads."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from worker.images.colour import SRGB, srgb_codes
from worker.images.encode import encoded
from worker.images.read import read_rgb


def png(path: Path, *, bits: Literal[8, 16] = 8) -> bytes:
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
        If it cannot be converted.
    """
    codes = srgb_codes(read_rgb(path, np.float32), bits=bits)
    with encoded(codes, to="png", store_as=f"uint{bits}", attributes={"oiio:ColorSpace": SRGB}) as file:
        return file.read()
