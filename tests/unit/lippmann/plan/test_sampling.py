"""Tiles: cut along lens edges, covering every pixel once."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from lippmann.job.optics.rig import Rig
from lippmann.lattice.layout import CellLayout
from lippmann.plan.sampling import cut_tiles, display_size, frame_size

counts = st.integers(1, 12)
squares = st.builds(CellLayout, counts, counts, st.integers(2, 9))
hexagons = st.builds(CellLayout, counts, counts, st.sampled_from([2, 4, 6, 8, 10]), st.just("hexagonal"))
sizes = squares | hexagons


def rig(**changes: object) -> Rig:
    return Rig.model_validate({"lens_array": {"count": (3, 4), **changes}, "px_per_lens": 8})


@given(sizes, st.integers(1, 15), st.integers(1, 15))
def test_tiles_cover_every_pixel_once(size: CellLayout, tile_rows: int, tile_cols: int) -> None:
    covered = np.zeros((size.rows, size.cols), int)
    for tile in cut_tiles(size, tile_rows=tile_rows, tile_cols=tile_cols):
        covered[tile.row_start : tile.row_stop, tile.col_start : tile.col_stop] += 1
    assert (covered == 1).all()


@given(sizes, st.integers(1, 15), st.integers(1, 15))
def test_tiles_are_about_equal(size: CellLayout, tile_rows: int, tile_cols: int) -> None:
    tiles = cut_tiles(size, tile_rows=tile_rows, tile_cols=tile_cols)
    assert len(tiles) == min(tile_rows, size.lens_rows) * min(tile_cols, size.lens_cols)
    rows, cols = ({getattr(tile, side) for tile in tiles} for side in ("rows", "cols"))
    assert max(rows) - min(rows) <= size.row_px + 2 * size.overhang_px
    assert max(cols) - min(cols) <= size.px_per_lens + size.px_per_lens // 2


@given(sizes, st.integers(1, 15), st.integers(1, 15))
def test_inner_tile_edges_lie_between_lens_rows_and_between_lenses(
    size: CellLayout, tile_rows: int, tile_cols: int
) -> None:
    for tile in cut_tiles(size, tile_rows=tile_rows, tile_cols=tile_cols):
        assert tile.px > 0
        for row in {tile.row_start, tile.row_stop} - {0, size.rows}:
            assert (row - size.overhang_px) % size.row_px == 0
        for col in {tile.col_start, tile.col_stop} - {0, size.cols}:
            assert col % size.px_per_lens == 0


def test_there_are_no_more_tiles_than_lenses() -> None:
    assert len(cut_tiles(CellLayout(2, 3, 8), tile_rows=64, tile_cols=64)) == 6


def test_a_frame_is_as_large_as_the_rig_says() -> None:
    assert frame_size(rig()) == CellLayout(3, 4, 8)
    assert frame_size(rig(lattice="hexagonal")) == CellLayout(3, 4, 8, "hexagonal")


def test_behind_an_imaging_lens_the_display_has_the_layout_turned() -> None:
    through_a_lens = rig(lattice="hexagonal")
    assert display_size(through_a_lens) == CellLayout(3, 4, 8, "hexagonal", first_row_shifted=True)
    assert display_size(through_a_lens.model_copy(update={"imaging_lens": None})) == CellLayout(3, 4, 8, "hexagonal")
    assert display_size(rig()) == CellLayout(3, 4, 8)
