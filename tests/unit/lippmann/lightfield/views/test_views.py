"""One pixel per lens: views, their grid, their order."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.cells import cells
from lippmann.lightfield.sheet.orthoscopic import half_turn_cells
from lippmann.lightfield.views.views import (
    centre,
    interlace,
    successive_views,
    view,
    view_numbers,
    view_of_grid,
    views_grid,
)
from tests.unit.lippmann.lightfield.sheets import (
    CHANNELS,
    DTYPES,
    HEXAGONAL_LAYOUTS,
    LAYOUTS,
    SQUARE_LAYOUTS,
    numbered_sheet,
)


@given(layout=LAYOUTS, channels=CHANNELS, dtype=DTYPES)
def test_interlace_is_the_inverse_of_views_grid(layout: CellLayout, channels: int, dtype: type) -> None:
    ortho = numbered_sheet(layout, channels, dtype)
    grid = views_grid(ortho, layout)
    assert grid.flags.c_contiguous
    np.testing.assert_array_equal(interlace(grid, layout), ortho)
    np.testing.assert_array_equal(views_grid(interlace(grid, layout), layout), grid)


@given(layout=LAYOUTS)
def test_the_grid_shows_view_u_v_at_column_u_and_row_v(layout: CellLayout) -> None:
    ortho = numbered_sheet(layout)
    grid = views_grid(ortho, layout)
    for u, v in view_numbers(layout):
        one = view(ortho, layout, u, v)
        np.testing.assert_array_equal(view_of_grid(grid, layout, u, v), one)
        for lens_row, lens_col in np.ndindex(layout.lens_rows, layout.lens_cols):
            np.testing.assert_array_equal(
                grid[v * layout.lens_rows + lens_row, u * layout.lens_cols + lens_col], one[lens_row, lens_col]
            )


@given(layout=LAYOUTS)
def test_where_there_is_no_view_the_grid_is_black(layout: CellLayout) -> None:
    grid = views_grid(np.ones((layout.rows, layout.cols, 2)), layout)
    lit = grid.reshape(layout.cell_rows, layout.lens_rows, layout.cell_cols, layout.lens_cols, 2)
    expected = layout.mask[:, np.newaxis, :, np.newaxis, np.newaxis]
    np.testing.assert_array_equal(lit, np.broadcast_to(expected, lit.shape))


@given(layout=LAYOUTS)
def test_the_further_right_and_down_the_eye_the_further_left_and_up_the_pixel(layout: CellLayout) -> None:
    ortho = numbered_sheet(layout)
    by_lens = cells(ortho, layout)
    for u, v in view_numbers(layout):
        np.testing.assert_array_equal(view(ortho, layout, u, v), by_lens[:, :, -1 - v, -1 - u])


def spot_in_front(*, rises_px_per_lens: int) -> tuple[np.ndarray, CellLayout]:
    """An orthoscopic sheet of one point: lit where a straight line from the point through the lens meets the cell."""
    layout = CellLayout(lens_rows=1, lens_cols=9, px_per_lens=9)
    ortho = np.zeros((layout.rows, layout.cols, 1), np.float32)
    for lens_col in range(9):
        col = 4 + rises_px_per_lens * (lens_col - 4)
        if 0 <= col < 9:
            cells(ortho, layout)[0, lens_col, 4, col] = 1
    return ortho, layout


def test_a_point_in_front_moves_against_the_eye_and_one_behind_with_it() -> None:
    # A lens right of a point in front (s > 0) sends light to it, to the left, from a pixel right of its axis.
    for rises, eye_to_the_right_moves_it in ((1, -1), (-1, +1)):
        ortho, layout = spot_in_front(rises_px_per_lens=rises)
        left, right = (int(view(ortho, layout, u, 4)[0, :, 0].argmax()) for u in (3, 5))
        assert np.sign(right - left) == eye_to_the_right_moves_it


def test_a_half_turn_of_the_cells_turns_front_into_back() -> None:
    front, layout = spot_in_front(rises_px_per_lens=1)
    behind, _ = spot_in_front(rises_px_per_lens=-1)
    np.testing.assert_array_equal(half_turn_cells(front, layout), behind)


@given(layout=LAYOUTS)
def test_there_are_as_many_views_as_pixels_under_a_lens(layout: CellLayout) -> None:
    assert len(view_numbers(layout)) == len(set(view_numbers(layout))) == layout.row_px * layout.px_per_lens


@given(layout=SQUARE_LAYOUTS)
def test_the_movie_shows_every_view_once_and_never_jumps(layout: CellLayout) -> None:
    n = layout.px_per_lens
    order = list(successive_views(layout))
    assert sorted(order) == [(u, v) for u in range(n) for v in range(n)]
    assert order[0] == (0, 0)
    for (u0, v0), (u1, v1) in pairwise(order):
        assert abs(u1 - u0) + abs(v1 - v0) == 1
    assert list(successive_views(layout, backward=True)) == order[::-1]


@given(st.integers(1, 32).map(lambda half: 2 * half))
def test_the_movie_of_hexagonal_views_shows_each_once_and_goes_sideways_by_two_at_most(n: int) -> None:
    layout = CellLayout(lens_rows=1, lens_cols=1, px_per_lens=n, lattice="hexagonal")
    order = list(successive_views(layout))
    assert sorted(order, key=lambda step: step[::-1]) == list(view_numbers(layout))
    for (u0, v0), (u1, v1) in pairwise(order):
        assert (v1 - v0, abs(u1 - u0)) in {(0, 1), (1, 0), (1, 1), (1, 2)}
    assert list(successive_views(layout, backward=True)) == order[::-1]


@given(st.integers(1, 20))
def test_the_centre_view_is_at_most_half_a_pixel_off_the_axis(n: int) -> None:
    u, v = centre(CellLayout(lens_rows=1, lens_cols=1, px_per_lens=n))
    assert abs(u - (n - 1) / 2) <= 0.5
    assert abs(v - (n - 1) / 2) <= 0.5


@given(layout=HEXAGONAL_LAYOUTS)
def test_the_centre_view_of_hexagons_is_there_and_half_a_pixel_off_the_axis_at_most(layout: CellLayout) -> None:
    u, v = centre(layout)
    assert (u, v) in view_numbers(layout)
    assert u - (layout.cell_cols - 1) / 2 == 0.5
    assert v - (layout.cell_rows - 1) / 2 in {0.0, 0.5}


@pytest.mark.parametrize(("u", "v"), [(-1, 0), (0, -1), (4, 0), (0, 4)])
def test_a_view_that_is_not_there_is_refused(u: int, v: int) -> None:
    layout = CellLayout(lens_rows=1, lens_cols=1, px_per_lens=4)
    with pytest.raises(LayoutError, match=r"from \(0, 0\) to \(3, 3\)"):
        view(np.zeros((4, 4, 3)), layout, u, v)
    with pytest.raises(LayoutError, match=r"from \(0, 0\) to \(3, 3\)"):
        view_of_grid(np.zeros((4, 4, 3)), layout, u, v)


def test_a_view_outside_the_hexagon_is_refused_by_its_number() -> None:
    layout = CellLayout(lens_rows=2, lens_cols=2, px_per_lens=8, lattice="hexagonal")
    assert (2, 1) not in view_numbers(layout)
    with pytest.raises(LayoutError, match=r"pixel lies under a hexagonal lens, got \(2, 1\)"):
        view(np.zeros((layout.rows, layout.cols, 3)), layout, 2, 1)
    with pytest.raises(LayoutError, match=r"from \(0, 0\) to \(7, 10\), got \(0, 11\)"):
        view(np.zeros((layout.rows, layout.cols, 3)), layout, 0, 11)


def test_a_grid_of_another_size_is_refused_with_both_sizes() -> None:
    layout = CellLayout(lens_rows=2, lens_cols=2, px_per_lens=8, lattice="hexagonal")
    sheet = np.zeros((layout.rows, layout.cols, 3))
    with pytest.raises(LayoutError, match=r"grid of views of 22 x 16 px for .*, got shape \(18, 20, 3\)"):
        interlace(sheet, layout)
    with pytest.raises(LayoutError, match="grid of views of 22 x 16 px"):
        view_of_grid(sheet, layout, 4, 4)
