"""Hexagonal views on square pixels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.square_pixels import as_square
from tests.unit.lippmann.lightfield.sheets import HEXAGONAL_LAYOUTS, ROW_PITCH, SQUARE_LAYOUTS, lens_centres

SLOPES = st.floats(-3, 3)


def from_the_middle(layout: CellLayout) -> tuple[np.ndarray, np.ndarray]:
    """Return the lenses' (x, y), in pitches from the middle of the sheet."""
    middle = layout.cols / layout.px_per_lens / 2, layout.rows / layout.row_px * ROW_PITCH / 2
    x, y = np.moveaxis(lens_centres(layout) - middle, -1, 0)
    return x, y


@given(layout=HEXAGONAL_LAYOUTS, along=SLOPES, down=SLOPES)
def test_a_ramp_stays_the_same_ramp(layout: CellLayout, along: float, down: float) -> None:
    x, y = from_the_middle(layout)
    shown = as_square((along * x + down * y)[:, :, np.newaxis], layout)[:, :, 0]
    rows, cols = layout.square_size()
    out_x, out_y = np.arange(cols) - (cols - 1) / 2, np.arange(rows) - (rows - 1) / 2
    inside = np.abs(out_y) <= y.max() + 1e-9
    assert inside.sum() >= rows - 2
    borders = slice(1, -1) if layout.lens_rows > 1 else slice(None)
    expected = (along * out_x[np.newaxis] + down * out_y[:, np.newaxis])[inside][:, borders]
    np.testing.assert_allclose(shown[inside][:, borders], expected, atol=1e-5)


@given(layout=HEXAGONAL_LAYOUTS, seed=st.integers(0, 99))
def test_the_turned_view_is_shown_turned(layout: CellLayout, seed: int) -> None:
    view = np.random.default_rng(seed).random((layout.lens_rows, layout.lens_cols, 3))
    turned = as_square(view[::-1, ::-1], layout.turned())
    np.testing.assert_allclose(turned, as_square(view, layout)[::-1, ::-1], atol=1e-5)


@given(layout=HEXAGONAL_LAYOUTS, seed=st.integers(0, 99))
def test_nothing_is_brighter_or_darker_than_the_view(layout: CellLayout, seed: int) -> None:
    view = np.random.default_rng(seed).random((layout.lens_rows, layout.lens_cols, 1)).astype(np.float16)
    shown = as_square(view, layout)
    assert shown.dtype == np.float16
    assert shown.shape == (*layout.square_size(), 1)
    assert view.min() <= shown.min() <= shown.max() <= view.max()


@given(layout=SQUARE_LAYOUTS)
def test_square_views_are_left_alone(layout: CellLayout) -> None:
    view = np.zeros((layout.lens_rows, layout.lens_cols, 3), np.float16)
    assert as_square(view, layout) is view
    assert layout.square_size() == view.shape[:2]


def test_the_view_itself_stays_as_it_is() -> None:
    view = np.random.default_rng(1).random((4, 4, 3)).astype(np.float32)
    before = view.copy()
    as_square(view, CellLayout(4, 4, 2, "hexagonal"))
    np.testing.assert_array_equal(view, before)


def test_a_view_of_another_array_is_refused() -> None:
    with pytest.raises(LayoutError, match=r"expected a view of 4 x 4 hexagonal lenses of 2 px, got .* \(4, 5, 3\)"):
        as_square(np.zeros((4, 5, 3)), CellLayout(4, 4, 2, "hexagonal"))
