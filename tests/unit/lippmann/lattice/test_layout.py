"""Which pixel lies under which lens."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.cell import Lattice
from lippmann.lattice.hexagonal import HexagonalCell
from lippmann.lattice.layout import CellLayout, check_size
from lippmann.lightfield.sheet.cells import cells, sheet_of
from tests.unit.lippmann.lightfield.sheets import (
    CHANNELS,
    DTYPES,
    HEXAGONAL_LAYOUTS,
    LAYOUTS,
    SQUARE_LAYOUTS,
    lens_centres,
    lens_numbers,
    numbered_sheet,
    px_centres,
)

TWO_BY_THREE = CellLayout(lens_rows=2, lens_cols=3, px_per_lens=4)


@given(layout=LAYOUTS, channels=CHANNELS, dtype=DTYPES)
def test_sheet_of_is_the_inverse_of_cells(layout: CellLayout, channels: int, dtype: type) -> None:
    sheet = numbered_sheet(layout, channels, dtype)
    back = sheet_of(cells(sheet, layout), layout)
    assert back.dtype == sheet.dtype
    np.testing.assert_array_equal(back, sheet)


@given(layout=SQUARE_LAYOUTS)
def test_every_pixel_lies_where_the_axes_say(layout: CellLayout) -> None:
    sheet = numbered_sheet(layout)
    by_lens = cells(sheet, layout)
    n = layout.px_per_lens
    for lens_row, lens_col, row, col in np.ndindex(by_lens.shape[:4]):
        np.testing.assert_array_equal(
            by_lens[lens_row, lens_col, row, col], sheet[lens_row * n + row, lens_col * n + col]
        )


@pytest.mark.parametrize("order", ["contiguous", "turned", "every second", "transposed"])
def test_cells_never_copy(order: str) -> None:
    big = np.zeros((16, 24, 3), dtype=np.float16)
    sheet = {
        "contiguous": big[:8, :12].copy(),
        "turned": big[:8, :12][::-1, ::-1],
        "every second": big[::2, ::2],
        "transposed": big.transpose(1, 0, 2)[:8, :12],
    }[order]
    by_lens = cells(sheet, TWO_BY_THREE)
    assert np.shares_memory(by_lens, sheet)
    by_lens[1, 2, 3, 3] = 1.0
    assert (sheet[7, 11] == 1.0).all()


def test_a_sheet_of_another_size_is_refused_with_both_sizes() -> None:
    layout = CellLayout(lens_rows=4, lens_cols=5, px_per_lens=8)
    with pytest.raises(LayoutError, match=r"^12 x 20 px do not divide among 5 x 4 lenses of 8 px$"):
        cells(np.zeros((20, 12, 3)), layout)


def test_a_sheet_without_channels_is_refused() -> None:
    with pytest.raises(LayoutError, match=r"expected a sheet \(rows, cols, channel\), got an array of shape \(8, 12\)"):
        cells(np.zeros((8, 12)), TWO_BY_THREE)


@pytest.mark.parametrize("shape", [(2, 3, 4, 4), (2, 3, 4, 5, 3), (3, 2, 4, 4, 3)])
def test_an_array_that_is_not_cells_makes_no_sheet(shape: tuple[int, ...]) -> None:
    with pytest.raises(LayoutError, match="expected cells of 3 x 2 lenses of 4 px"):
        sheet_of(np.zeros(shape), TWO_BY_THREE)


@pytest.mark.parametrize("bad", [(0, 1, 1), (1, 0, 1), (1, 1, 0), (-1, 1, 1)])
def test_a_layout_has_at_least_one_lens_of_one_pixel(bad: tuple[int, int, int]) -> None:
    with pytest.raises(LayoutError, match="at least one lens"):
        CellLayout(*bad)


@given(layout=LAYOUTS)
def test_every_pixel_belongs_to_the_lens_it_lies_under_and_to_no_other(layout: CellLayout) -> None:
    numbers = lens_numbers(layout)
    lenses = layout.lens_rows * layout.lens_cols
    by_lens = cells(numbers[:, :, np.newaxis] + 1, layout)[..., 0]
    own = np.arange(1, lenses + 1).reshape(layout.lens_rows, layout.lens_cols, 1, 1)
    np.testing.assert_array_equal(by_lens, own * layout.mask)
    assert (numbers >= 0).sum() == lenses * layout.mask.sum()


@given(layout=LAYOUTS)
def test_the_middle_of_a_cell_is_the_centre_of_its_lens(layout: CellLayout) -> None:
    x, y = px_centres(layout)
    places = np.stack(np.broadcast_arrays(x[np.newaxis, :], y[:, np.newaxis]), axis=-1)
    by_lens, counts = cells(places, layout), layout.mask.sum()
    np.testing.assert_allclose(by_lens.sum(axis=(2, 3)) / counts, lens_centres(layout), atol=1e-12)


@given(layout=HEXAGONAL_LAYOUTS, channels=CHANNELS, dtype=DTYPES)
def test_what_lies_outside_the_hexagons_is_left_out(layout: CellLayout, channels: int, dtype: type) -> None:
    full: np.ndarray = np.ones((layout.rows, layout.cols, channels), dtype)
    gathered = cells(full, layout)
    np.testing.assert_array_equal(gathered[0, 0, :, :, 0], layout.mask)
    np.testing.assert_array_equal(sheet_of(np.ones_like(gathered), layout)[:, :, 0], lens_numbers(layout) >= 0)


@given(layout=LAYOUTS)
def test_a_mask_is_the_same_turned_and_mirrored(layout: CellLayout) -> None:
    np.testing.assert_array_equal(layout.mask, layout.mask[::-1, ::-1])
    np.testing.assert_array_equal(layout.mask, layout.mask[:, ::-1])


@given(layout=LAYOUTS)
def test_a_layout_turned_twice_is_itself_and_stays_as_large(layout: CellLayout) -> None:
    assert layout.turned().turned() == layout
    assert (layout.turned().rows, layout.turned().cols) == (layout.rows, layout.cols)


@given(layout=HEXAGONAL_LAYOUTS)
def test_the_lenses_of_a_turned_sheet_stand_where_its_layout_says(layout: CellLayout) -> None:
    turned = lens_numbers(layout)[::-1, ::-1]
    last = layout.lens_rows * layout.lens_cols - 1
    np.testing.assert_array_equal(lens_numbers(layout.turned()), np.where(turned < 0, -1, last - turned))


@given(st.integers(1, 256).map(lambda half: 2 * half))
def test_hexagonal_pixels_are_nearly_square_and_hexagons_fit_in_their_boxes(n: int) -> None:
    m = HexagonalCell().row_px(n)
    assert abs(m - n * math.sqrt(3) / 2) <= 1
    assert m % 2 != n // 2 % 2
    # The corners above and below are 2 m / 3 rows from the centre.
    assert m / 2 + HexagonalCell().overhang_px(m) >= 2 * m / 3 > m / 2 + HexagonalCell().overhang_px(m) - 1


@given(st.integers(1, 40).map(lambda half: 2 * half), st.integers(1, 8))
def test_no_pixel_lies_on_a_border_even_when_divided(n: int, k: int) -> None:
    m = HexagonalCell().row_px(n)
    a = np.abs(2 * np.arange(n * k) + 1 - n * k)
    b = np.abs(2 * np.arange(2 * m * k) + 1 - m * k)
    assert (m * a[np.newaxis] + 3 * (n // 2) * b[:, np.newaxis] != 2 * m * n * k).all()


def test_the_hexagon_of_eight_pixels_is_this_one() -> None:
    drawn = ["........", "...##...", ".######.", *["########"] * 5, ".######.", "...##...", "........"]
    mask = HexagonalCell().mask(px_per_lens=8, row_px=7, overhang_px=2)
    assert ["".join(".#"[px] for px in row) for row in mask.tolist()] == drawn


def test_a_hexagonal_sheet_has_room_for_the_shifted_rows_and_the_corners() -> None:
    layout = CellLayout(lens_rows=3, lens_cols=4, px_per_lens=8, lattice="hexagonal")
    assert (layout.row_px, layout.overhang_px, layout.cell_rows, layout.cell_cols) == (7, 2, 11, 8)
    assert (layout.rows, layout.cols) == (3 * 7 + 4, 4 * 8 + 4)
    assert (layout.row_edges, layout.col_edges) == ((0, 9, 16, 25), (0, 8, 16, 24, 36))
    assert [layout.shift_px(row) for row in range(3)] == [0, 4, 0]
    assert [layout.turned().shift_px(row) for row in range(3)] == [4, 0, 4]
    one_row = CellLayout(lens_rows=1, lens_cols=4, px_per_lens=8, lattice="hexagonal")
    assert (one_row.rows, one_row.cols, one_row.turned()) == (11, 32, one_row)


def test_an_odd_number_of_pixels_across_a_hexagon_is_refused() -> None:
    with pytest.raises(LayoutError, match="expected an even number of px across a hexagonal lens, got 7"):
        CellLayout(2, 2, 7, "hexagonal")


@pytest.mark.parametrize(("lens_rows", "lattice"), [(2, "square"), (1, "hexagonal")])
def test_only_one_of_several_hexagonal_rows_can_be_shifted(lens_rows: int, lattice: Lattice) -> None:
    with pytest.raises(LayoutError, match="shifted row among several hexagonal ones"):
        CellLayout(lens_rows, 2, 8, lattice, first_row_shifted=True)


def test_a_sheet_of_another_pitch_is_told_the_one_that_fits() -> None:
    with pytest.raises(LayoutError, match=r"2362 x 2362 px do not divide among 100 x 100 .* a pitch of 23\.62 px fits"):
        check_size(2362, 2362, CellLayout(100, 100, 24))
    with pytest.raises(LayoutError, match=r"of 8 px$"):
        check_size(100, 200, CellLayout(10, 10, 8))


@given(layout=LAYOUTS.filter(lambda layout: layout.px_per_lens > 1))
def test_at_the_overlap_depth_a_point_moves_over_all_lenses_but_one_from_view_to_view(layout: CellLayout) -> None:
    focal_mm, (high, wide) = 3.3, layout.square_size()
    depth_mm = layout.overlap_depth(focal_mm)
    pixel_down, pixel_right = layout.pixel_mm(1.0)
    moves = depth_mm / focal_mm * pixel_down, depth_mm / focal_mm * pixel_right
    left_over = [lenses - 1 - move for lenses, move in zip((high, wide), moves, strict=True)]
    assert min(left_over) == pytest.approx(0, abs=1e-9)


@given(layout=LAYOUTS)
def test_views_in_rows_and_cols_are_those_of_the_mask(layout: CellLayout) -> None:
    for v in range(-1, layout.cell_rows + 1):
        there = [u for u in range(-1, layout.cell_cols + 1) if layout.has_view(u, v)]
        assert list(layout.views_in_row(v)) == there
        assert (v in layout.rows_of_views) == bool(there)
        assert all(v in layout.views_in_col(u) for u in there)
    assert layout.mask.sum() == sum(len(layout.views_in_row(v)) for v in layout.rows_of_views)
