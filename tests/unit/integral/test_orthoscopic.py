"""From the capture to what is shown."""

from __future__ import annotations

import numpy as np
from hypothesis import given

from tests.unit.integral.sheets import CHANNELS, DTYPES, LAYOUTS, numbered_sheet
from worker.integral.layout import CellLayout, cells
from worker.integral.orthoscopic import half_turn_cells, orthoscopic, turn_sheet
from worker.integral.views import view

LETTER_F = np.array([[1, 1, 1], [1, 0, 0], [1, 1, 0], [1, 0, 0], [1, 0, 0]], dtype=np.float32)[:, :, np.newaxis]


@given(layout=LAYOUTS, channels=CHANNELS, dtype=DTYPES)
def test_each_turn_twice_is_nothing(layout: CellLayout, channels: int, dtype: type) -> None:
    sheet = numbered_sheet(layout, channels, dtype)
    for turn in (lambda s: half_turn_cells(s, layout), turn_sheet, lambda s: orthoscopic(s, layout)):
        twice = turn(turn(sheet))
        assert twice.dtype == sheet.dtype
        np.testing.assert_array_equal(twice, sheet)


@given(layout=LAYOUTS)
def test_orthoscopic_is_both_steps_in_either_order(layout: CellLayout) -> None:
    captured = numbered_sheet(layout)
    np.testing.assert_array_equal(orthoscopic(captured, layout), turn_sheet(half_turn_cells(captured, layout)))
    np.testing.assert_array_equal(orthoscopic(captured, layout), half_turn_cells(turn_sheet(captured), layout))


@given(layout=LAYOUTS)
def test_orthoscopic_reorders_the_lenses_and_keeps_every_cell(layout: CellLayout) -> None:
    captured = numbered_sheet(layout)
    before, after = cells(captured, layout), cells(orthoscopic(captured, layout), layout)
    for lens_row, lens_col in np.ndindex(layout.lens_rows, layout.lens_cols):
        np.testing.assert_array_equal(after[lens_row, lens_col], before[-1 - lens_row, -1 - lens_col])


def test_an_f_captured_upside_down_comes_out_upright_in_every_view() -> None:
    layout = CellLayout(lens_rows=5, lens_cols=3, px_per_lens=4)
    inverted = LETTER_F[::-1, ::-1]
    captured = inverted.repeat(4, axis=0).repeat(4, axis=1)
    ortho = orthoscopic(captured, layout)
    for u, v in np.ndindex(4, 4):
        np.testing.assert_array_equal(view(ortho, layout, u, v), LETTER_F)


def test_the_capture_stays_as_it_was() -> None:
    layout = CellLayout(lens_rows=3, lens_cols=3, px_per_lens=3)
    captured = numbered_sheet(layout)
    before = captured.copy()
    made = (half_turn_cells(captured, layout), orthoscopic(captured, layout))
    for sheet in made:
        sheet[:] = 0
    np.testing.assert_array_equal(captured, before)
    assert all(sheet.flags.c_contiguous for sheet in made)
