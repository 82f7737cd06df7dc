"""Black shapes and words in pictures. A pixel that a shape covers in part is grey by the share.

The font is Bitstream Vera, which comes with reportlab.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OpenImageIO import FLOAT, ImageBuf, ImageBufAlgo, ImageSpec

from lippmann.errors import OutputError
from lippmann.plan.printing.shapes import Bar, Ring, Shape, TextLine


def paper(shapes: Iterable[Shape], *, pixel_mm: float, top: int, rows: int, cols: int) -> NDArray[np.float32]:
    """Return some rows of a page with shapes on it.

    Parameters
    ----------
    shapes
        The shapes, in mm from the upper left corner of the page.
    pixel_mm
        Pitch of the page's pixels.
    top, rows, cols
        The rows [top, top + rows) and the width of the page, px.

    Returns
    -------
    NDArray
        `(rows, cols)`, linear light: 1 is white paper, 0 is ink.
    """
    ink = np.zeros((rows, cols), dtype=np.float32)
    for shape in shapes:
        if isinstance(shape, Bar):
            if shape.bottom_mm > top * pixel_mm and shape.top_mm < (top + rows) * pixel_mm:
                _draw_bar(ink, shape, pixel_mm, top)
        elif isinstance(shape, Ring):
            _draw_ring(ink, shape, pixel_mm, top)
        else:
            _draw_words(ink, shape, pixel_mm, top)
    light: NDArray[np.float32] = np.float32(1) - ink
    return light


def _draw_bar(ink: NDArray[np.float32], bar: Bar, pixel_mm: float, top: int) -> None:
    from_row, down = _covered(bar.top_mm / pixel_mm - top, bar.bottom_mm / pixel_mm - top, ink.shape[0])
    from_col, across = _covered(bar.left_mm / pixel_mm, bar.right_mm / pixel_mm, ink.shape[1])
    _draw_over(ink, np.outer(down, across), from_row, from_col)


def _covered(start: float, stop: float, count: int) -> tuple[int, NDArray[np.float64]]:
    """Return the first of `count` pixels that the range from start to stop, px, covers, and the share of each pixel."""
    # Places are rounded to whole pixels if they differ from them by rounding only.
    start, stop = round(max(start, 0.0), 6), round(min(stop, count), 6)
    first = int(np.floor(start))
    edges = np.arange(first, max(first, int(np.ceil(stop))) + 1)
    return first, np.clip(np.minimum(edges[1:], stop) - np.maximum(edges[:-1], start), 0.0, 1.0)


def _draw_ring(ink: NDArray[np.float32], ring: Ring, pixel_mm: float, top: int) -> None:
    x, y = ring.x_mm / pixel_mm, ring.y_mm / pixel_mm - top
    radius, line = ring.radius_mm / pixel_mm, ring.line_mm / pixel_mm
    far = radius + line + 1
    rows = np.arange(max(0, int(y - far)), min(ink.shape[0], int(y + far) + 1))
    cols = np.arange(max(0, int(x - far)), min(ink.shape[1], int(x + far) + 1))
    if rows.size and cols.size:
        away = np.hypot(rows[:, np.newaxis] + 0.5 - y, cols[np.newaxis] + 0.5 - x)
        _draw_over(ink, np.clip((line + 1) / 2 - np.abs(away - radius), 0.0, 1.0), int(rows[0]), int(cols[0]))


def _draw_words(ink: NDArray[np.float32], words: TextLine, pixel_mm: float, top: int) -> None:
    size_px = max(6, round(words.size_mm / pixel_mm))
    letters = _letters(words.text, size_px)
    row = round(words.baseline_mm / pixel_mm) - size_px - top
    col = round(words.x_mm / pixel_mm - words.centred * letters.shape[1] / 2)
    above, below = max(0, -row), max(0, row + letters.shape[0] - ink.shape[0])
    shown = letters[above : letters.shape[0] - below, max(0, -col) : max(0, ink.shape[1] - col)]
    _draw_over(ink, shown, max(0, row), max(0, col))


@lru_cache(maxsize=64)
def _letters(text: str, size_px: int) -> NDArray[np.float32]:
    return lettering(text, size_px=size_px)


def _draw_over(ink: NDArray[np.float32], more: NDArray[np.floating[Any]], row: int, col: int) -> None:
    """Draw ink over ink: the result is the darker of both."""
    part = ink[row : row + more.shape[0], col : col + more.shape[1]]
    if part.size:
        np.maximum(part, more, out=part)


def lettering(text: str, *, size_px: int) -> NDArray[np.float32]:
    """Return a line of text.

    Parameters
    ----------
    text
        The text; letters that the font lacks become boxes.
    size_px
        The size of the font, px.

    Returns
    -------
    NDArray
        `(line_px(size_px), cols)`: 1 where there is ink, 0 elsewhere.

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
    """Return the height of a line of text, px, with room for descenders."""
    return size_px + -(-size_px // 3)


@lru_cache(maxsize=1)
def font_path() -> str:
    """Return the path of the font."""
    return str(files("reportlab") / "fonts" / "Vera.ttf")
