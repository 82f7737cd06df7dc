"""Tiles become the whole sheet, every lens covered once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.job.messages.orders import TileIndex
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.assemble import TilePlace, assembled
from lippmann.plan.sampling import Tile, cut_tiles
from tests.unit.lippmann.lightfield.sheets import LAYOUTS, numbered_sheet

LAYOUT = CellLayout(lens_rows=4, lens_cols=5, px_per_lens=2)
SHEET = numbered_sheet(LAYOUT)


def tile(row_start: int, row_stop: int, col_start: int, col_stop: int) -> Tile:
    return Tile(TileIndex(row=0, col=0), row_start, row_stop, col_start, col_stop)


def cut(place: Tile) -> tuple[Tile, np.ndarray]:
    return place, SHEET[place.row_start : place.row_stop, place.col_start : place.col_stop]


def assemble(layout: CellLayout, tiles: Iterable[tuple[TilePlace, np.ndarray]]) -> np.ndarray:
    return np.concatenate(list(assembled(layout, tiles)))


TOP, BOTTOM = tile(0, 4, 0, 10), tile(4, 8, 0, 10)


@given(layout=LAYOUTS, tile_rows=st.integers(1, 6), tile_cols=st.integers(1, 6), data=st.data())
def test_planned_tiles_strip_by_strip_give_the_whole_back(
    layout: CellLayout, tile_rows: int, tile_cols: int, data: st.DataObject
) -> None:
    sheet = numbered_sheet(layout)
    places = data.draw(st.permutations(cut_tiles(layout, tile_rows=tile_rows, tile_cols=tile_cols)))
    places.sort(key=lambda place: place.row_start)
    whole = assemble(layout, ((p, sheet[p.row_start : p.row_stop, p.col_start : p.col_stop]) for p in places))
    assert whole.dtype == sheet.dtype
    np.testing.assert_array_equal(whole, sheet)


@given(rows=st.sets(st.integers(1, 3)), cols=st.sets(st.integers(1, 4)), data=st.data())
def test_any_one_tile_missing_or_twice_is_refused(rows: set[int], cols: set[int], data: st.DataObject) -> None:
    row_edges = [0, *(2 * edge for edge in sorted(rows)), 8]
    col_edges = [0, *(2 * edge for edge in sorted(cols)), 10]
    places = [tile(*r, *c) for r in pairwise(row_edges) for c in pairwise(col_edges)]
    chosen = data.draw(st.integers(0, len(places) - 1))
    with pytest.raises(LayoutError, match="got none over"):
        assemble(LAYOUT, map(cut, places[:chosen] + places[chosen + 1 :]))
    with pytest.raises(LayoutError, match="expected every lens in one tile"):
        assemble(LAYOUT, map(cut, [*places, places[chosen]]))


def test_tiles_in_another_order_are_refused() -> None:
    with pytest.raises(LayoutError, match="none over 10 of them, the first at row 0, col 0"):
        assemble(LAYOUT, map(cut, [BOTTOM, TOP]))
    places = [tile(0, 4, 0, 4), tile(0, 8, 4, 10), tile(4, 8, 0, 4)]
    with pytest.raises(LayoutError, match="the next one in rows 0 to 4, got rows 0 to 8, cols 4 to 10"):
        assemble(LAYOUT, map(cut, places))


def test_tiles_are_taken_one_at_a_time() -> None:
    taken = []

    def reading() -> Iterator[tuple[Tile, np.ndarray]]:
        for place in (TOP, BOTTOM):
            taken.append(place)
            yield cut(place)
            assert len(taken) == (1 if place is TOP else 2)

    np.testing.assert_array_equal(assemble(LAYOUT, reading()), SHEET)


def test_a_gap_names_its_first_lens() -> None:
    with pytest.raises(LayoutError, match="none over 10 of them, the first at row 2, col 0"):
        assemble(LAYOUT, [cut(TOP)])


def test_no_tiles_are_a_gap() -> None:
    with pytest.raises(LayoutError, match="none over 20 of them"):
        assemble(LAYOUT, [])


def test_a_hexagonal_tile_takes_what_reaches_beyond_the_outer_lens_rows() -> None:
    layout = CellLayout(lens_rows=3, lens_cols=2, px_per_lens=8, lattice="hexagonal")
    sheet = numbered_sheet(layout)
    places = [tile(0, 16, 0, 8), tile(0, 16, 8, 20), tile(16, 25, 0, 20)]
    cut_sheet = [(place, sheet[place.row_start : place.row_stop, place.col_start : place.col_stop]) for place in places]
    np.testing.assert_array_equal(assemble(layout, cut_sheet), sheet)
    with pytest.raises(LayoutError, match="none over 2 of them, the first at row 2, col 0"):
        assemble(layout, cut_sheet[:2])
    with pytest.raises(LayoutError, match="cut along lens edges, got rows 2 to 16, cols 0 to 8"):
        assemble(layout, [(tile(2, 16, 0, 8), sheet[2:16, 0:8])])


@pytest.mark.parametrize(
    "place", [tile(0, 3, 0, 10), tile(0, 4, 1, 10), tile(0, 10, 0, 10), tile(4, 4, 0, 10), tile(-2, 4, 0, 10)]
)
def test_a_tile_outside_or_off_the_lens_edges_is_refused(place: Tile) -> None:
    with pytest.raises(LayoutError, match="cut along lens edges, got rows"):
        assemble(LAYOUT, [(place, np.zeros((4, 10, 3), np.float32))])


@pytest.mark.parametrize(
    "pixels", [np.zeros((4, 9, 3)), np.zeros((8, 10, 3)), np.zeros((4, 10)), np.zeros((4, 10, 3, 1))]
)
def test_a_tile_of_another_size_than_its_place_is_refused(pixels: np.ndarray) -> None:
    with pytest.raises(LayoutError, match="expected a tile of"):
        assemble(LAYOUT, [(TOP, pixels)])


@pytest.mark.parametrize("pixels", [np.zeros((4, 10, 4), np.float32), np.zeros((4, 10, 3), np.float16)])
def test_tiles_that_differ_in_channels_or_dtype_are_refused(pixels: np.ndarray) -> None:
    with pytest.raises(LayoutError, match="expected a tile of"):
        assemble(LAYOUT, [cut(TOP), (BOTTOM, pixels)])
