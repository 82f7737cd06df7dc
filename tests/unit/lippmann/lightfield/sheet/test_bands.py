"""Whatever is made of a sheet in bands equals what is made of it whole, bit by bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet import device
from lippmann.lightfield.sheet.bands import (
    HeldRows,
    OrthoscopicSheet,
    SheetOfRows,
    TurnedSheet,
    bands,
    part_layout,
    part_rows,
    stitched,
    view_bands,
)
from lippmann.lightfield.sheet.cells import cells
from lippmann.lightfield.sheet.device import to_device
from lippmann.lightfield.sheet.orthoscopic import orthoscopic, orthoscopic_layout, turn_sheet
from lippmann.lightfield.views.views import views_grid
from tests.unit.lippmann.lightfield.sheets import CHANNELS, DTYPES, HEXAGONAL_LAYOUTS, LAYOUTS, numbered_sheet

BAND_PX = st.integers(1, 2000)


def sheet_of(layout: CellLayout, channels: int = 3, dtype: type = np.float32) -> SheetOfRows:
    """A sheet with light beside the lenses too, as a capture may have, and none of it zero."""
    pixels = np.arange(1, layout.px * channels + 1).reshape(layout.rows, layout.cols, channels)
    return SheetOfRows(HeldRows(pixels.astype(dtype)), layout)


def whole(sheet: SheetOfRows) -> np.ndarray:
    return sheet.picture.read(0, sheet.layout.rows)


@given(layout=LAYOUTS, band_px=BAND_PX)
def test_bands_are_every_lens_row_once_top_down(layout: CellLayout, band_px: int) -> None:
    found = bands(layout, band_px)
    assert [row for band in found for row in range(*band)] == [*range(layout.lens_rows)]
    least = min(2, layout.lens_rows) if layout.lattice == "hexagonal" else 1
    assert all(stop - first >= least for first, stop in found)


@given(layout=LAYOUTS, data=st.data())
def test_the_cells_of_a_part_are_those_of_the_sheet(layout: CellLayout, data: st.DataObject) -> None:
    first, stop = data.draw(st.sampled_from(bands(layout, data.draw(BAND_PX))))
    sheet = sheet_of(layout)
    part = sheet.part(first, stop)
    assert part_rows(layout, first, stop)[1] - part_rows(layout, first, stop)[0] == len(part)
    np.testing.assert_array_equal(
        cells(part, part_layout(layout, first, stop)), cells(whole(sheet), layout)[first:stop]
    )


@given(layout=LAYOUTS, channels=CHANNELS, dtype=DTYPES, band_px=BAND_PX, inverted=st.booleans())
def test_orthoscopic_in_bands_is_orthoscopic_of_the_whole(
    layout: CellLayout, channels: int, dtype: type, band_px: int, inverted: bool
) -> None:
    sheet = sheet_of(layout, channels, dtype)
    made = OrthoscopicSheet(sheet, inverted=inverted)
    assert made.layout == orthoscopic_layout(layout, inverted=inverted)
    streamed = np.concatenate(list(stitched(made, band_px)))
    expected = orthoscopic(whole(sheet), layout, inverted=inverted)
    assert streamed.dtype == expected.dtype
    np.testing.assert_array_equal(streamed, expected)


@given(layout=HEXAGONAL_LAYOUTS, band_px=BAND_PX)
def test_bits_that_are_no_number_and_negative_zeros_come_through(layout: CellLayout, band_px: int) -> None:
    pixels = numbered_sheet(layout)
    pixels[pixels % 3 == 1] = np.nan
    pixels[pixels % 3 == 2] = -0.0
    made = OrthoscopicSheet(SheetOfRows(HeldRows(pixels), layout), inverted=True)
    streamed = np.concatenate(list(stitched(made, band_px)))
    np.testing.assert_array_equal(streamed.view(np.uint32), orthoscopic(pixels, layout).view(np.uint32))


@given(layout=LAYOUTS, inverted=st.booleans(), data=st.data())
def test_any_lens_rows_can_be_had(layout: CellLayout, inverted: bool, data: st.DataObject) -> None:
    sheet = sheet_of(layout)
    made, after = OrthoscopicSheet(sheet, inverted=inverted), orthoscopic_layout(layout, inverted=inverted)
    first = data.draw(st.integers(0, layout.lens_rows - 1))
    stop = data.draw(st.integers(first + 1, layout.lens_rows))
    start, end = part_rows(after, first, stop)
    found, expected = made.part(first, stop), orthoscopic(whole(sheet), layout, inverted=inverted)[start:end]
    own = np.zeros((after.rows, after.cols), dtype=bool)
    for lens_row in range(first, stop):
        for lens_col in range(layout.lens_cols):
            left = after.shift_px(lens_row) + lens_col * layout.px_per_lens
            top = lens_row * layout.row_px
            own[top : top + layout.cell_rows, left : left + layout.px_per_lens] |= layout.mask
    np.testing.assert_array_equal(found[own[start:end]], expected[own[start:end]])


@given(layout=LAYOUTS, band_px=BAND_PX)
def test_a_turned_sheet_is_turned_in_bands(layout: CellLayout, band_px: int) -> None:
    sheet = sheet_of(layout)
    streamed = np.concatenate(list(stitched(TurnedSheet(sheet), band_px)))
    np.testing.assert_array_equal(streamed, turn_sheet(whole(sheet)))


@given(layout=LAYOUTS, channels=CHANNELS, band_px=BAND_PX)
def test_views_in_bands_are_the_grid_of_views(layout: CellLayout, channels: int, band_px: int) -> None:
    sheet = sheet_of(layout, channels)
    grid = views_grid(whole(sheet), layout)
    by_lens_row = grid.reshape(layout.cell_rows, layout.lens_rows, *grid.shape[1:])
    seen = 0
    for first, views in view_bands(sheet, band_px):
        assert first == seen
        seen += views.shape[1]
        np.testing.assert_array_equal(views, by_lens_row[:, first:seen])
    assert seen == layout.lens_rows


@given(layout=LAYOUTS, per_lens=st.floats(0.7, 12), margin_px=st.integers(0, 3))
def test_a_device_in_bands_is_the_device(layout: CellLayout, per_lens: float, margin_px: int) -> None:
    sheet = sheet_of(layout)
    expected = to_device(whole(sheet), layout, px_per_lens_device=per_lens, margin_px=margin_px)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(device, "ROWS_AT_ONCE", 3)
        patch.setattr(device, "PX_AT_ONCE", 1)
        made = device.device_bands(sheet, px_per_lens_device=per_lens, margin_px=margin_px)
        np.testing.assert_array_equal(np.concatenate(list(made)), expected)


def test_a_picture_of_another_size_is_refused() -> None:
    with pytest.raises(LayoutError, match="5 x 4 px do not divide among 2 x 2 lenses of 2 px"):
        SheetOfRows(HeldRows(np.zeros((4, 5, 3))), CellLayout(2, 2, 2))
