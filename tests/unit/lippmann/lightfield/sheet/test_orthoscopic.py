"""From the capture to what is shown."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given

from lippmann.errors import LayoutError
from lippmann.lattice.cell import Lattice
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.cells import cells
from lippmann.lightfield.sheet.orthoscopic import half_turn_cells, orthoscopic, orthoscopic_layout, turn_sheet
from lippmann.lightfield.views.views import view
from tests.unit.lippmann.lightfield.sheets import (
    CHANNELS,
    DTYPES,
    HEXAGONAL_LAYOUTS,
    LAYOUTS,
    lens_numbers,
    numbered_sheet,
)

LETTER_F = np.array([[1, 1, 1], [1, 0, 0], [1, 1, 0], [1, 0, 0], [1, 0, 0]], dtype=np.float32)[:, :, np.newaxis]


@given(layout=LAYOUTS, channels=CHANNELS, dtype=DTYPES)
def test_each_turn_twice_is_nothing(layout: CellLayout, channels: int, dtype: type) -> None:
    sheet = numbered_sheet(layout, channels, dtype)
    for twice in (
        half_turn_cells(half_turn_cells(sheet, layout), layout),
        turn_sheet(turn_sheet(sheet)),
        orthoscopic(orthoscopic(sheet, layout), orthoscopic_layout(layout)),
        orthoscopic(orthoscopic(sheet, layout, inverted=False), layout, inverted=False),
    ):
        assert twice.dtype == sheet.dtype
        np.testing.assert_array_equal(twice, sheet)


@given(layout=LAYOUTS)
def test_orthoscopic_is_both_steps_in_either_order(layout: CellLayout) -> None:
    captured = numbered_sheet(layout)
    np.testing.assert_array_equal(orthoscopic(captured, layout), turn_sheet(half_turn_cells(captured, layout)))
    np.testing.assert_array_equal(orthoscopic(captured, layout), half_turn_cells(turn_sheet(captured), layout.turned()))


@given(layout=LAYOUTS)
def test_direct_pickup_turns_the_cells_and_leaves_the_picture(layout: CellLayout) -> None:
    captured = numbered_sheet(layout)
    shown = orthoscopic(captured, layout, inverted=False)
    assert orthoscopic_layout(layout, inverted=False) == layout
    np.testing.assert_array_equal(cells(shown, layout), cells(captured, layout)[:, :, ::-1, ::-1])


@given(layout=LAYOUTS)
def test_orthoscopic_reorders_the_lenses_and_keeps_every_cell(layout: CellLayout) -> None:
    captured = numbered_sheet(layout)
    before, after = cells(captured, layout), cells(orthoscopic(captured, layout), orthoscopic_layout(layout))
    for lens_row, lens_col in np.ndindex(layout.lens_rows, layout.lens_cols):
        np.testing.assert_array_equal(after[lens_row, lens_col], before[-1 - lens_row, -1 - lens_col])


def test_an_f_captured_upside_down_comes_out_upright_in_every_view() -> None:
    layout = CellLayout(lens_rows=5, lens_cols=3, px_per_lens=4)
    inverted = LETTER_F[::-1, ::-1]
    captured = inverted.repeat(4, axis=0).repeat(4, axis=1)
    ortho = orthoscopic(captured, layout)
    for u, v in np.ndindex(4, 4):
        np.testing.assert_array_equal(view(ortho, layout, u, v), LETTER_F)


@given(layout=HEXAGONAL_LAYOUTS)
def test_light_from_beside_the_lenses_is_left_out(layout: CellLayout) -> None:
    captured = np.ones((layout.rows, layout.cols, 3), np.float32)
    for inverted in (True, False):
        dark = orthoscopic(captured, layout, inverted=inverted)[:, :, 0] == 0
        np.testing.assert_array_equal(dark, lens_numbers(orthoscopic_layout(layout, inverted=inverted)) < 0)


@pytest.mark.parametrize("turn", [half_turn_cells, orthoscopic])
@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_a_sheet_of_another_size_is_not_turned(
    turn: Callable[[np.ndarray, CellLayout], np.ndarray], lattice: Lattice
) -> None:
    layout = CellLayout(lens_rows=3, lens_cols=3, px_per_lens=4, lattice=lattice)
    with pytest.raises(LayoutError, match="do not divide among 3 x 3"):
        turn(np.zeros((layout.rows, layout.cols + 1, 3)), layout)


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_the_capture_stays_as_it_was(lattice: Lattice) -> None:
    layout = CellLayout(lens_rows=3, lens_cols=3, px_per_lens=4, lattice=lattice)
    captured = numbered_sheet(layout)
    before = captured.copy()
    made = (half_turn_cells(captured, layout), orthoscopic(captured, layout))
    for sheet in made:
        sheet[:] = 0
    np.testing.assert_array_equal(captured, before)
    assert all(sheet.flags.c_contiguous for sheet in made)
