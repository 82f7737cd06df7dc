"""From k x k times the pixels to the sheet, without mixing neighbours."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.supersample import average_in_cells
from lippmann.plan.sampling import cut_tiles
from tests.unit.lippmann.lightfield.sheets import CHANNELS, LAYOUTS, lens_numbers, numbered_sheet

FACTORS = st.integers(1, 5)


@given(layout=LAYOUTS, k=FACTORS)
def test_lenses_of_one_colour_each_keep_it_to_the_border(layout: CellLayout, k: int) -> None:
    fine = (lens_numbers(layout, k) + 1)[:, :, np.newaxis].astype(np.float32)
    averaged = average_in_cells(fine, layout, k)
    np.testing.assert_array_equal(averaged[:, :, 0], lens_numbers(layout) + 1)


@given(layout=LAYOUTS, k=FACTORS, channels=CHANNELS, seed=st.integers(0, 99))
def test_a_pixel_is_the_mean_of_the_fine_ones_under_its_own_lens(
    layout: CellLayout, k: int, channels: int, seed: int
) -> None:
    fine = np.random.default_rng(seed).random((layout.rows * k, layout.cols * k, channels))
    averaged = average_in_cells(fine, layout, k)
    own, fine_own = lens_numbers(layout), lens_numbers(layout, k)
    for row, col in np.ndindex(own.shape):
        block = slice(row * k, (row + 1) * k), slice(col * k, (col + 1) * k)
        expected = fine[block][fine_own[block] == own[row, col]].mean(axis=0) if own[row, col] >= 0 else 0.0
        np.testing.assert_allclose(averaged[row, col], expected, rtol=1e-6)


@given(layout=LAYOUTS)
def test_one_pixel_for_one_changes_nothing(layout: CellLayout) -> None:
    sheet = numbered_sheet(layout)
    np.testing.assert_array_equal(average_in_cells(sheet, layout, 1), sheet)


@given(layout=LAYOUTS, k=FACTORS, tile_rows=st.integers(1, 3), tile_cols=st.integers(1, 3))
def test_tiles_come_out_as_the_whole_does(layout: CellLayout, k: int, tile_rows: int, tile_cols: int) -> None:
    fine = np.random.default_rng(1).random((layout.rows * k, layout.cols * k, 3)).astype(np.float16)
    whole = average_in_cells(fine, layout, k)
    for tile in cut_tiles(layout, tile_rows=tile_rows, tile_cols=tile_cols):
        part = fine[tile.row_start * k : tile.row_stop * k, tile.col_start * k : tile.col_stop * k]
        averaged = average_in_cells(part, layout, k, row_start=tile.row_start, col_start=tile.col_start)
        expected = whole[tile.row_start : tile.row_stop, tile.col_start : tile.col_stop]
        np.testing.assert_array_equal(averaged, expected)


def test_half_floats_stay_half_floats_and_are_summed_in_single_precision() -> None:
    fine = np.full((8, 8, 3), 40_000, np.float16)
    averaged = average_in_cells(fine, CellLayout(1, 1, 2), 4)
    assert averaged.dtype == np.float16
    assert (averaged == np.float16(40_000)).all()


def test_a_region_that_does_not_divide_is_refused() -> None:
    with pytest.raises(LayoutError, match="expected a region of 3 x 3 times the pixels"):
        average_in_cells(np.zeros((8, 9, 3)), CellLayout(2, 2, 2), 3)


@pytest.mark.parametrize(("row_start", "col_start"), [(1, 0), (0, 3), (-1, 0)])
def test_a_region_outside_the_sheet_is_refused(row_start: int, col_start: int) -> None:
    with pytest.raises(LayoutError, match="inside 4 x 4 px, got 4 x 2 px"):
        average_in_cells(np.zeros((8, 4, 3)), CellLayout(2, 2, 2), 2, row_start=row_start, col_start=col_start)
