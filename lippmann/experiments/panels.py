"""Pictures side by side, pixel for pixel, with a caption under each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worker.images.colour import srgb_codes
from worker.images.resize import resize

Codes = NDArray[np.uint8]

DPI = 100
GAP_PX = 14
LINE_PX = 18
FONT_PT = 10.5
"""The font size, points: about 15 px at 100 dpi."""


@dataclass(frozen=True)
class Panel:
    """One picture `(rows, cols, 3)` of sRGB codes, and its caption."""

    picture: Codes
    caption: str
    """The caption; its lines are not wrapped."""

    @property
    def height(self) -> int:
        """The height of picture and caption, px."""
        return int(self.picture.shape[0]) + GAP_PX + LINE_PX * len(self.caption.splitlines())


def write_panels(path: Path, rows: Sequence[Sequence[Panel]]) -> None:
    """Write rows of panels as one PNG on white."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    widths = [sum(panel.picture.shape[1] + GAP_PX for panel in row) + GAP_PX for row in rows]
    heights = [max(panel.height for panel in row) for row in rows]
    width, height = max(widths), sum(heights) + GAP_PX
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    top = GAP_PX
    for row, row_height in zip(rows, heights, strict=True):
        _put_row(figure, row, top=top, height=height, width=width)
        top += row_height
    figure.savefig(path, dpi=DPI)


def _put_row(figure: Any, row: Sequence[Panel], *, top: int, height: int, width: int) -> None:
    left = GAP_PX
    for panel in row:
        rows, cols = panel.picture.shape[:2]
        # Places are counted from the bottom, and `figimage` does not resample.
        figure.figimage(panel.picture, left, height - top - rows, origin="upper")
        below = (height - top - rows - 8) / height
        figure.text((left + cols / 2) / width, below, panel.caption, ha="center", va="top", fontsize=FONT_PT)
        left += cols + GAP_PX


def enlarged(linear: NDArray[Any], factor: int) -> Codes:
    """Return a picture `(rows, cols, 3)` as sRGB codes, with each pixel enlarged to a square of `factor` px."""
    codes: Codes = srgb_codes(linear)
    return codes.repeat(factor, axis=0).repeat(factor, axis=1)


def fitted(linear: NDArray[Any], longest_px: int) -> Codes:
    """Return a picture as sRGB codes, resampled in linear light to `longest_px` on its longer side."""
    rows, cols = linear.shape[:2]
    factor = longest_px / max(rows, cols)
    size = {"rows": max(1, round(rows * factor)), "cols": max(1, round(cols * factor))}
    codes: Codes = srgb_codes(resize(linear, **size, filter_name="triangle" if factor < 1 else "mitchell"))
    return codes


def cut(linear: NDArray[Any], *, middle: tuple[int, int], side_px: int) -> NDArray[Any]:
    """Return a square of a picture about (row, col), shifted to lie inside the picture."""
    starts = [
        min(max(0, at - side_px // 2), max(0, whole - side_px))
        for at, whole in zip(middle, linear.shape[:2], strict=True)
    ]
    return linear[starts[0] : starts[0] + side_px, starts[1] : starts[1] + side_px]
