"""The size of a picture that is written, and the filter by which it is resized."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput
from lippmann.job.optics.viewing import Filter
from worker.images.resize import resize

MAX_SIDE_PX = 32_768
"""The longest side of a picture, px; a longer one comes of a mistyped number."""


@dataclass(frozen=True)
class PictureSize:
    """The size of a picture; its own if neither field is given."""

    scale: float | None = None
    """The factor by which the picture is enlarged."""
    longer_px: int | None = None
    """The longer side, px, in place of a scale."""
    filter_name: Filter = "lanczos3"

    def __post_init__(self) -> None:
        """Refuse a size that cannot be.

        Raises
        ------
        BadInput
            If both are given, or one is not positive.
        """
        if self.scale is not None and self.longer_px is not None:
            raise BadInput("expected either --scale or --size, got both")
        if self.scale is not None and not 0 < self.scale < math.inf:
            raise BadInput(f"expected a --scale above 0, got {self.scale:g}")
        if self.longer_px is not None and not 1 <= self.longer_px <= MAX_SIDE_PX:
            raise BadInput(f"expected a --size of 1 to {MAX_SIDE_PX} px, got {self.longer_px}")

    def of(self, rows: int, cols: int) -> tuple[int, int]:
        """Return the (rows, cols) to which a picture is resized.

        Parameters
        ----------
        rows, cols
            The size of the picture, px.

        Raises
        ------
        BadInput
            If it is too large.
        """
        factor = self.longer_px / max(rows, cols) if self.longer_px is not None else self.scale or 1.0
        sides = max(1, math.floor(rows * factor + 0.5)), max(1, math.floor(cols * factor + 0.5))
        check_side(max(sides))
        return sides

    def sized(self, picture: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
        """Resize a picture `(row, col, channel)` of linear light to this size."""
        rows, cols = self.of(*picture.shape[:2])
        if (rows, cols) == picture.shape[:2]:
            return picture
        return resize(picture, rows=rows, cols=cols, filter_name=self.filter_name)


def check_side(longer_px: int) -> None:
    """Refuse a picture that is larger than `MAX_SIDE_PX`.

    Raises
    ------
    BadInput
        Naming the longest side.
    """
    if longer_px > MAX_SIDE_PX:
        raise BadInput(f"expected a picture of at most {MAX_SIDE_PX} px a side, got {longer_px}")
