"""Pictures put together, and views between views."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.interpolate import spread_views, views_in_col, views_in_row
from lippmann.lightfield.views.mosaic import cut_to_aspect, mosaic
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view, view_numbers
from tests.unit.lippmann.lightfield.sheets import image_of

SQUARE = CellLayout(4, 5, 6)
HEXAGONAL = CellLayout(4, 5, 6, "hexagonal")


@given(count=some.integers(1, 12), columns=some.integers(1, 5), gap=some.integers(0, 3), upward=some.booleans())
def test_every_tile_is_where_it_should_be_and_the_rest_is_background(
    count: int, columns: int, gap: int, upward: bool
) -> None:
    tiles = [np.full((2, 3, 1), float(number + 1)) for number in range(count)]
    whole = mosaic(iter(tiles), count=count, columns=columns, gap_px=gap, background=-1.0, upward=upward)
    rows = -(-count // columns)
    for number, tile in enumerate(tiles):
        row, col = divmod(number, columns)
        top = gap + (rows - 1 - row if upward else row) * (2 + gap)
        left = gap + col * (3 + gap)
        np.testing.assert_array_equal(whole[top : top + 2, left : left + 3], tile)
    assert (whole > 0).sum() == 6 * count
    assert whole.shape == (rows * (2 + gap) + gap, columns * (3 + gap) + gap, 1)


@pytest.mark.parametrize("tiles", [[(2, 3)], [(2, 3), (2, 4)], [(2, 3)] * 3, []])
def test_too_few_too_many_or_unlike_tiles_are_refused(tiles: list[tuple[int, int]]) -> None:
    with pytest.raises(LayoutError, match="expected 2 pictures"):
        mosaic((np.zeros((*size, 3)) for size in tiles), count=2, columns=2)


@given(rows=some.integers(1, 40), cols=some.integers(1, 40), aspect=some.floats(0.2, 5.0))
def test_a_cut_is_the_middle_and_the_largest_of_its_aspect(rows: int, cols: int, aspect: float) -> None:
    picture = np.arange(rows * cols).reshape(rows, cols, 1)
    cut = cut_to_aspect(picture, aspect)
    assert cut.shape[0] == rows or cut.shape[1] == cols
    high, wide = cut.shape[:2]
    assert abs(wide - high * aspect) <= max(0.5, aspect / 2) + 1e-9 or 1 in (high, wide)
    top, left = divmod(int(cut[0, 0, 0]), cols)
    assert abs((rows - high) - 2 * top) <= 1
    assert abs((cols - wide) - 2 * left) <= 1


@pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL])
def test_the_rows_and_columns_of_views_are_all_views_once(layout: CellLayout) -> None:
    numbers = set(view_numbers(layout))
    assert {(u, v) for v in range(layout.cell_rows) if layout.mask[v].any() for u in views_in_row(layout, v)} == numbers
    assert {(u, v) for u in range(layout.cell_cols) for v in views_in_col(layout, u)} == numbers


@pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL])
def test_as_many_views_as_there_are_are_these(layout: CellLayout) -> None:
    ortho = np.random.default_rng(4).random((layout.rows, layout.cols, 3), dtype=np.float32)
    for v in (layout.cell_rows // 2, layout.cell_rows - 3):
        there = views_in_row(layout, v)
        for u, seen in zip(there, spread_views(image_of(ortho, layout), v, len(there)), strict=True):
            np.testing.assert_array_equal(seen, as_square(view(ortho, layout, u, v), layout))


def test_views_between_views_are_interpolated_evenly_from_end_to_end() -> None:
    ortho = np.random.default_rng(5).random((SQUARE.rows, SQUARE.cols, 3), dtype=np.float32)
    views = [view(ortho, SQUARE, u, 2) for u in range(6)]
    found = list(spread_views(image_of(ortho, SQUARE), 2, 11))
    np.testing.assert_array_equal(found[0], views[0])
    np.testing.assert_array_equal(found[10], views[5])
    np.testing.assert_allclose(found[3], (views[1] + views[2]) / 2, atol=1e-6)
    (middle,) = spread_views(image_of(ortho, SQUARE), 2, 1)
    np.testing.assert_allclose(middle, (views[2] + views[3]) / 2, atol=1e-6)


def test_a_row_of_views_that_is_not_there_is_refused() -> None:
    with pytest.raises(LayoutError, match="from 0 to 5, got 6"):
        views_in_row(SQUARE, 6)
    with pytest.raises(LayoutError, match="a column of views"):
        views_in_col(SQUARE, -1)
