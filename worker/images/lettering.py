"""Words in pictures. The font is Bitstream Vera, which comes with reportlab, so it is there wherever we are."""

from __future__ import annotations

from functools import lru_cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray
from OpenImageIO import FLOAT, ImageBuf, ImageBufAlgo, ImageSpec

from lippmann.errors import OutputError


def lettering(text: str, *, size_px: int) -> NDArray[np.float32]:
    """Return a line of text.

    Parameters
    ----------
    text
        What it says; letters that the font does not have are boxes.
    size_px
        Of the font.

    Returns
    -------
    NDArray
        `(line_px(size_px), cols)`: 1 where there is ink, 0 where there is none.

    Raises
    ------
    OutputError
        If OpenImageIO cannot draw it.
    """
    extent = ImageBufAlgo.text_size(text, size_px, font_path())
    drawn = ImageBuf(ImageSpec(max(1, extent.xend + 1), line_px(size_px), 1, FLOAT))
    if not ImageBufAlgo.render_text(drawn, 0, size_px, text, size_px, font_path(), 1.0):
        raise OutputError(f"cannot draw {text!r}: {drawn.geterror()}")
    return np.asarray(drawn.get_pixels(FLOAT), dtype=np.float32)[:, :, 0]


def line_px(size_px: int) -> int:
    """Return the height of a line of text, with room for what reaches below it."""
    return size_px + -(-size_px // 3)


@lru_cache(maxsize=1)
def font_path() -> str:
    """Return where the font lies."""
    return str(files("reportlab") / "fonts" / "Vera.ttf")
