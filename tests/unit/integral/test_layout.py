"""Which pixel lies under which lens."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

from tests.unit.integral.sheets import CHANNELS, DTYPES, LAYOUTS, numbered_sheet
from worker.errors import LayoutError
from worker.integral.layout import CellLayout, cells, sheet_of

TWO_BY_THREE = CellLayout(lens_rows=2, lens_cols=3, px_per_lens=4)


@given(layout=LAYOUTS, channels=CHANNELS, dtype=DTYPES)
def test_sheet_of_is_the_inverse_of_cells(layout: CellLayout, channels: int, dtype: type) -> None:
    sheet = numbered_sheet(layout, channels, dtype)
    back = sheet_of(cells(sheet, layout))
    assert back.dtype == sheet.dtype
    np.testing.assert_array_equal(back, sheet)


@given(layout=LAYOUTS)
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
    with pytest.raises(LayoutError, match=r"^20 x 12 px do not divide among 4 x 5 lenses of 8 px$"):
        cells(np.zeros((20, 12, 3)), layout)


def test_a_sheet_without_channels_is_refused() -> None:
    with pytest.raises(LayoutError, match=r"expected a sheet \(rows, cols, channel\), got an array of shape \(8, 12\)"):
        cells(np.zeros((8, 12)), TWO_BY_THREE)


@pytest.mark.parametrize("shape", [(2, 3, 4, 4), (2, 3, 4, 5, 3)])
def test_an_array_that_is_not_cells_makes_no_sheet(shape: tuple[int, ...]) -> None:
    with pytest.raises(LayoutError, match="expected cells"):
        sheet_of(np.zeros(shape))


@pytest.mark.parametrize("bad", [(0, 1, 1), (1, 0, 1), (1, 1, 0), (-1, 1, 1)])
def test_a_layout_has_at_least_one_lens_of_one_pixel(bad: tuple[int, int, int]) -> None:
    with pytest.raises(LayoutError, match="at least one lens"):
        CellLayout(*bad)
