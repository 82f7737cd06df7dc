"""Pictures of one size put together into one."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import Pixel


def mosaic(
    tiles: Iterable[NDArray[Pixel]],
    *,
    count: int,
    columns: int,
    gap_px: int = 0,
    background: float = 0.0,
    upward: bool = False,
) -> NDArray[Pixel]:
    """Put tiles side by side, row by row from the left, and fill the last row up with background.

    Parameters
    ----------
    tiles
        `count` pictures `(rows, cols, channel)` of one size and dtype; no two of them are held at a time.
    count, columns
        Of tiles, in all and side by side.
    gap_px
        The gap between tiles and around them, px.
    background
        Between tiles.
    upward
        The first row is the lowest.

    Raises
    ------
    LayoutError
        If there are not so many tiles, or one has another size.

    Examples
    --------
    >>> mosaic((np.full((1, 1, 1), k) for k in range(4)), count=4, columns=2, upward=True)[:, :, 0]
    array([[2, 3],
           [0, 1]])
    """
    whole, rows = None, -(-count // columns)
    for number, tile in enumerate(tiles):
        if whole is None:
            shape = [many * side + (many + 1) * gap_px for many, side in zip((rows, columns), tile.shape, strict=False)]
            whole, size = np.full((*shape, tile.shape[2]), background, dtype=tile.dtype), tile.shape
        if tile.shape != size or number >= count:
            raise LayoutError(f"expected {count} pictures of {size}, got one of {tile.shape} as number {number + 1}")
        row, col = divmod(number, columns)
        top, left = (rows - 1 - row if upward else row), col
        top, left = gap_px + top * (size[0] + gap_px), gap_px + left * (size[1] + gap_px)
        whole[top : top + size[0], left : left + size[1]] = tile
    if whole is None or number != count - 1:
        raise LayoutError(f"expected {count} pictures, got fewer")
    return whole


def cut_to_aspect(picture: NDArray[Pixel], aspect: float) -> NDArray[Pixel]:
    """Return the middle of a picture, cut to an aspect ratio.

    Parameters
    ----------
    picture
        `(rows, cols, channel)`, any dtype.
    aspect
        Width by height.
    """
    rows, cols = picture.shape[:2]
    high, wide = min(rows, max(1, round(cols / aspect))), min(cols, max(1, round(rows * aspect)))
    top, left = (rows - high) // 2, (cols - wide) // 2
    return picture[top : top + high, left : left + wide]
