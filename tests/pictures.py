"""Pictures as other programs read them: Pillow and libtiff, independent readers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OpenImageIO import ImageBuf
from PIL import Image, TiffTags


def read_png(path: Path) -> NDArray[np.uint8]:
    """Return the codes of an 8-bit picture, `(rows, cols, 3)`."""
    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB"))


def read_tiff(path: Path | str) -> NDArray[Any]:
    """Return the numbers of a TIFF, `(rows, cols, channel)`, as libtiff reads them."""
    picture = ImageBuf(str(path))
    numbers: NDArray[Any] | None = picture.get_pixels(picture.spec().format)
    assert numbers is not None, picture.geterror()
    return numbers


def read_png_16(path: Path) -> NDArray[np.uint16]:
    """Return the codes of a 16-bit PNG as they are stored, `(rows, cols, 3)`."""
    codes = read_tiff(path)
    assert codes.dtype == np.uint16
    return codes


def tags_of_tiff(path: Path | str) -> dict[str, Any]:
    """Return the tags of a TIFF by name, as Pillow reads them; a fraction has a numerator and a denominator."""
    with Image.open(path) as picture:
        return {TiffTags.lookup(number).name: value for number, value in picture.tag_v2.items()}  # type: ignore[attr-defined]  # of a TIFF
