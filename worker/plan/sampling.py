"""Where millimetres meet pixels: the size of an integral image, and tiles cut along lens edges.

Pixels count from the top left: row 0 is the top, col 0 the left, as the observer sees the display.
"""

from __future__ import annotations

from dataclasses import dataclass

from worker.integral.layout import CellLayout
from worker.job.orders import TileIndex
from worker.job.spec import Rig


@dataclass(frozen=True)
class Tile:
    """A part of a frame, cut along lens edges: pixel rows [row_start, row_stop), likewise cols."""

    index: TileIndex
    row_start: int
    row_stop: int
    col_start: int
    col_stop: int

    @property
    def rows(self) -> int:
        """Height, px."""
        return self.row_stop - self.row_start

    @property
    def cols(self) -> int:
        """Width, px."""
        return self.col_stop - self.col_start

    @property
    def px(self) -> int:
        """Pixels in all."""
        return self.rows * self.cols


def frame_size(rig: Rig) -> CellLayout:
    """Return the size of the integral images that a rig captures."""
    lens_rows, lens_cols = rig.lens_array.count
    return CellLayout(lens_rows=lens_rows, lens_cols=lens_cols, px_per_lens=rig.px_per_lens)


def cut_tiles(size: CellLayout, *, tile_rows: int, tile_cols: int) -> tuple[Tile, ...]:
    """Cut a frame into about equal tiles along lens edges, row by row; no more tiles than lenses.

    Examples
    --------
    >>> [(t.row_start, t.row_stop) for t in cut_tiles(CellLayout(5, 1, 8), tile_rows=2, tile_cols=1)]
    [(0, 16), (16, 40)]
    """
    row_edges = _edges(size.lens_rows, tile_rows, size.px_per_lens)
    col_edges = _edges(size.lens_cols, tile_cols, size.px_per_lens)
    return tuple(
        Tile(TileIndex(row=row, col=col), row_edges[row], row_edges[row + 1], col_edges[col], col_edges[col + 1])
        for row in range(len(row_edges) - 1)
        for col in range(len(col_edges) - 1)
    )


def _edges(lenses: int, parts: int, px_per_lens: int) -> list[int]:
    parts = min(parts, lenses)
    return [(lenses * part // parts) * px_per_lens for part in range(parts + 1)]
