"""Tiles: cut along lens edges, covering every pixel once."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from worker.integral.layout import CellLayout
from worker.plan.sampling import cut_tiles

sizes = st.builds(CellLayout, st.integers(1, 12), st.integers(1, 12), st.integers(2, 9))


@given(sizes, st.integers(1, 15), st.integers(1, 15))
def test_tiles_cover_every_pixel_once(size: CellLayout, tile_rows: int, tile_cols: int) -> None:
    covered = np.zeros((size.rows, size.cols), int)
    for tile in cut_tiles(size, tile_rows=tile_rows, tile_cols=tile_cols):
        covered[tile.row_start : tile.row_stop, tile.col_start : tile.col_stop] += 1
    assert (covered == 1).all()


@given(sizes, st.integers(1, 15), st.integers(1, 15))
def test_tile_edges_lie_on_lens_edges(size: CellLayout, tile_rows: int, tile_cols: int) -> None:
    for tile in cut_tiles(size, tile_rows=tile_rows, tile_cols=tile_cols):
        edges = (tile.row_start, tile.row_stop, tile.col_start, tile.col_stop)
        assert all(edge % size.px_per_lens == 0 for edge in edges)
        assert tile.px > 0


def test_there_are_no_more_tiles_than_lenses() -> None:
    assert len(cut_tiles(CellLayout(2, 3, 8), tile_rows=64, tile_cols=64)) == 6
