"""Pictures as other programs read them: Pillow, an independent reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image


def read_png(path: Path) -> NDArray[np.uint8]:
    """Return the codes of an 8-bit picture, `(rows, cols, 3)`."""
    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB"))
