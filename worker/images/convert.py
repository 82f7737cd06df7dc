"""A linear EXR as PNG bytes, for the service. Safe to call from any number of threads."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from worker.images.read import read_rgb
from worker.images.write import encoded_png


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
