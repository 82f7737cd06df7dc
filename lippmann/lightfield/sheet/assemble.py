"""Assemble tiles into the sheet; every lens is covered once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout, Pixel


class TilePlace(Protocol):
    """The place of a tile in the sheet: pixel rows [row_start, row_stop) and columns [col_start, col_stop)."""

    @property
    def row_start(self) -> int:
        """First row, px."""

    @property
    def row_stop(self) -> int:
        """One past the last row, px."""

    @property
    def col_start(self) -> int:
        """First col, px."""

    @property
    def col_stop(self) -> int:
        """One past the last col, px."""


def assembled(layout: CellLayout, tiles: Iterable[tuple[TilePlace, NDArray[Pixel]]]) -> Iterator[NDArray[Pixel]]:
    """Put tiles together and yield the sheet's rows, top down, a strip of tiles at a time.

    Tiles are taken one at a time, so a generator that reads them holds no more than a strip and a tile.

    Parameters
    ----------
    layout
        Of the whole sheet.
    tiles
        Places, cut along the layout's `row_edges` and `col_edges`, and their pixels `(rows, cols, channel)`, all of
        one dtype; strip by strip, and those of a strip, which are equally high, in any order.

    Yields
    ------
    NDArray
        `(rows, cols, channel)` in the tiles' dtype; together all rows of the sheet.

    Raises
    ------
    LayoutError
        If tiles leave a gap, overlap, lie outside, are not cut along lens edges, are not as large as their place,
        differ in dtype or channels, or come in another order.
    """
    covered = np.zeros((layout.lens_rows, layout.lens_cols), dtype=bool)
    ready, strip, like = 0, None, None
    for place, pixels in tiles:
        _check_place(place, layout)
        like = pixels if like is None else like
        _check_pixels(place, pixels, like)
        if strip is not None and place.row_start >= ready + len(strip):
            ready += len(strip)
            _check_covered(covered, layout, ready)
            yield strip
            strip = None
        _cover(covered, place, layout)
        if strip is None:
            _check_covered(covered, layout, place.row_start)
            strip = np.empty((place.row_stop - place.row_start, layout.cols, *pixels.shape[2:]), dtype=pixels.dtype)
        if (place.row_start, place.row_stop) != (ready, ready + len(strip)):
            rows = f"rows {ready} to {ready + len(strip)}"
            raise LayoutError(f"expected tiles strip by strip, the next one in {rows}, got {_where(place)}")
        strip[:, place.col_start : place.col_stop] = pixels
    _check_covered(covered, layout, layout.rows)
    if strip is not None:
        yield strip


def _check_place(place: TilePlace, layout: CellLayout) -> None:
    rows, cols = (place.row_start, place.row_stop), (place.col_start, place.col_stop)
    on_edges = {*rows} <= {*layout.row_edges} and {*cols} <= {*layout.col_edges}
    if not on_edges or rows[0] >= rows[1] or cols[0] >= cols[1]:
        raise LayoutError(f"expected a tile inside {layout} and cut along lens edges, got {_where(place)}")


def _check_pixels(place: TilePlace, pixels: NDArray[Any], like: NDArray[Any]) -> None:
    expected = (place.row_stop - place.row_start, place.col_stop - place.col_start, *like.shape[2:])
    if pixels.ndim != 3 or pixels.shape != expected or pixels.dtype != like.dtype:
        raise LayoutError(
            f"expected a tile of {expected} {like.dtype} at {_where(place)}, got {pixels.shape} {pixels.dtype}"
        )


def _cover(covered: NDArray[np.bool_], place: TilePlace, layout: CellLayout) -> None:
    row, row_after = (layout.row_edges.index(edge) for edge in (place.row_start, place.row_stop))
    col, col_after = (layout.col_edges.index(edge) for edge in (place.col_start, place.col_stop))
    lenses = covered[row:row_after, col:col_after]
    if lenses.any():
        raise LayoutError(f"expected every lens in one tile, got a second tile over the lenses of {_where(place)}")
    lenses[:] = True


def _check_covered(covered: NDArray[np.bool_], layout: CellLayout, row_stop: int) -> None:
    """Refuse a gap above a pixel row where tiles end."""
    above = covered[: layout.row_edges.index(row_stop)]
    if not above.all():
        lens_row, lens_col = np.argwhere(~above)[0]
        raise LayoutError(
            f"expected tiles over all of {layout}, got none over {(~above).sum()} of them,"
            f" the first at row {lens_row}, col {lens_col}"
        )


def _where(place: TilePlace) -> str:
    return f"rows {place.row_start} to {place.row_stop}, cols {place.col_start} to {place.col_stop}"
