"""The integral image on a device's pixels: cells of whole device pixels, never mixed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.device import device_size, to_device
from lippmann.lightfield.sheet.orthoscopic import turn_sheet
from tests.unit.lippmann.lightfield.sheets import (
    HEXAGONAL_LAYOUTS,
    LAYOUTS,
    ROW_PITCH,
    SQUARE_LAYOUTS,
    lens_centres,
    lens_numbers,
    numbered_sheet,
    px_centres,
)

AT_600_DPI = 600 / 25.4
AT_203_DPI = 203 / 25.4
GRIDS = st.sampled_from([1.3, 3.37, 7.992, AT_600_DPI])
MORE = st.integers(0, 3)


def middle(layout: CellLayout) -> tuple[float, float]:
    """Return the (x, y) of the array's middle, in pitches from the sheet's top left corner."""
    height = 1.0 if layout.lattice == "square" else ROW_PITCH
    return layout.cols / layout.px_per_lens / 2, layout.rows / layout.row_px * height / 2


def device_centres(shape: tuple[int, ...], layout: CellLayout, d: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the (x, y) of every device pixel, in pitches from the sheet's top left corner."""
    x0, y0 = middle(layout)
    row, col = np.mgrid[: shape[0], : shape[1]]
    return x0 + (col + 0.5 - shape[1] / 2) / d, y0 + (row + 0.5 - shape[0] / 2) / d


def nearest_lens(x: np.ndarray, y: np.ndarray, layout: CellLayout) -> np.ndarray:
    """Return the number of the nearest lens of the array, whether the place lies under it or not.

    On a border the one to the right or below, of hexagons whose border slants the upper: a nudge decides.
    """
    x, y = x + 1e-8, y + (1e-8 if layout.lattice == "square" else -1e-6)
    centres = lens_centres(layout).reshape(-1, 2)
    away = np.hypot(x[..., np.newaxis] - centres[:, 0], y[..., np.newaxis] - centres[:, 1])
    numbers: np.ndarray = away.argmin(axis=-1)
    return numbers


def from_own_centre(x: np.ndarray, y: np.ndarray, layout: CellLayout) -> tuple[np.ndarray, np.ndarray]:
    centres = lens_centres(layout).reshape(-1, 2)[nearest_lens(x, y, layout)]
    return x - centres[..., 0], y - centres[..., 1]


def under_a_lens(dx: np.ndarray, dy: np.ndarray, layout: CellLayout) -> np.ndarray:
    """Say whether a place lies under the lens, border included, from whose centre it is (dx, dy) away."""
    across = np.abs(dy) if layout.lattice == "square" else np.abs(dx) / 2 + np.abs(dy) * ROW_PITCH
    under: np.ndarray = np.maximum(np.abs(dx), across) <= 0.5 + 1e-9
    return under


def coded_by_lens(layout: CellLayout) -> np.ndarray:
    return (lens_numbers(layout) + 1)[:, :, np.newaxis].astype(np.float32)


@given(layout=SQUARE_LAYOUTS, dtype=st.sampled_from([np.float16, np.float32, np.float64]))
def test_on_its_own_grid_a_sheet_stays_as_it_is(layout: CellLayout, dtype: type) -> None:
    sheet = numbered_sheet(layout, 3, dtype)
    shown = to_device(sheet, layout, px_per_lens_device=float(layout.px_per_lens))
    assert shown.dtype == dtype
    np.testing.assert_array_equal(shown, sheet)


@given(layout=LAYOUTS, d=GRIDS, more=st.tuples(MORE, MORE))
def test_every_device_pixel_shows_the_lens_it_lies_under_and_no_other(
    layout: CellLayout, d: float, more: tuple[int, int]
) -> None:
    rows, cols = device_size(layout, px_per_lens_device=d)
    window = rows + more[0], cols + more[1]
    shown = to_device(coded_by_lens(layout), layout, px_per_lens_device=d, window=window)[:, :, 0]
    assert shown.shape == window
    x, y = device_centres(window, layout, d)
    dx, dy = from_own_centre(x, y, layout)
    lit = under_a_lens(dx, dy, layout)
    np.testing.assert_array_equal(shown, np.where(lit, nearest_lens(x, y, layout) + 1, 0))


@given(layout=SQUARE_LAYOUTS, d=GRIDS)
def test_a_ramp_in_every_square_cell_is_reproduced_up_to_its_outermost_pixels(layout: CellLayout, d: float) -> None:
    x, y = np.meshgrid(*px_centres(layout))
    sheet = np.stack(from_own_centre(x, y, layout), axis=-1)
    shown = to_device(sheet, layout, px_per_lens_device=d)
    held = 0.5 - 0.5 / layout.px_per_lens
    places = from_own_centre(*device_centres(shown.shape, layout, d), layout)
    np.testing.assert_allclose(shown, np.clip(np.stack(places, axis=-1), -held, held), atol=1e-5)


@given(layout=HEXAGONAL_LAYOUTS, d=GRIDS)
def test_a_ramp_in_every_hexagon_is_reproduced_but_for_its_outermost_pixels(layout: CellLayout, d: float) -> None:
    x, y = np.meshgrid(*px_centres(layout))
    sheet = np.stack(from_own_centre(x, y, layout), axis=-1)
    sheet[lens_numbers(layout) < 0] = 1000
    shown = to_device(sheet, layout, px_per_lens_device=d)
    dx, dy = from_own_centre(*device_centres(shown.shape, layout, d), layout)
    expected = np.stack((dx, dy), axis=-1)
    px = np.array([1 / layout.px_per_lens, ROW_PITCH / layout.row_px])
    inner = under_a_lens(np.abs(dx) + px[0], np.abs(dy) + px[1], layout)
    np.testing.assert_allclose(shown[inner], expected[inner], atol=1e-5)
    lit = under_a_lens(dx, dy, layout)
    assert (np.abs(shown - expected)[lit] <= [2.5, 1.0] * px).all()


@given(layout=LAYOUTS, d=GRIDS, seed=st.integers(0, 99))
def test_a_turned_sheet_is_shown_turned(layout: CellLayout, d: float, seed: int) -> None:
    sheet = np.random.default_rng(seed).random((layout.rows, layout.cols, 2))
    rows, cols = device_size(layout, px_per_lens_device=d)
    # An even window leaves no pixel on the border in the middle, which belongs to one side.
    window = rows + rows % 2, cols + cols % 2
    shown = to_device(sheet, layout, px_per_lens_device=d, window=window)
    turned = to_device(turn_sheet(sheet), layout.turned(), px_per_lens_device=d, window=window)
    np.testing.assert_allclose(turned, turn_sheet(shown), atol=1e-5)


def run_lengths(line: np.ndarray) -> list[int]:
    borders = np.flatnonzero(np.diff(line))
    return [int(run) for run in np.diff([-1, *borders, line.size - 1])]


def test_at_600_dpi_cells_of_23_and_24_pixels_alternate() -> None:
    layout = CellLayout(lens_rows=2, lens_cols=100, px_per_lens=24)
    shown = to_device(coded_by_lens(layout), layout, px_per_lens_device=AT_600_DPI)
    runs = run_lengths(shown[0, :, 0])
    assert shown.shape[:2] == (47, 2362)
    assert len(runs) == 100
    assert set(runs) == {23, 24}
    assert sum(runs) == 2362
    first = np.cumsum(runs)[:-1]
    # Every border is the device pixel nearest to where it should be.
    np.testing.assert_array_less(np.abs(first - 1181 - (np.arange(1, 100) - 50) * AT_600_DPI), 0.5)


def test_at_203_dpi_cells_have_8_pixels() -> None:
    layout = CellLayout(lens_rows=1, lens_cols=90, px_per_lens=8)
    shown = to_device(coded_by_lens(layout), layout, px_per_lens_device=AT_203_DPI)
    runs = run_lengths(shown[0, :, 0])
    assert len(runs) == 90
    assert sum(runs) == 719
    assert sorted(runs)[:2] == [7, 8]
    assert max(runs) == 8


def test_the_papers_hundred_lenses_stand_19_pixels_inside_its_window() -> None:
    layout = CellLayout(lens_rows=100, lens_cols=100, px_per_lens=2)
    shown = to_device(np.ones((200, 200, 1), np.float16), layout, px_per_lens_device=AT_600_DPI, window=(2400, 2400))
    lit = np.flatnonzero(shown.any(axis=(1, 2)))
    assert (lit[0], lit[-1]) == (19, 2400 - 19 - 1)
    np.testing.assert_array_equal(shown, np.swapaxes(shown, 0, 1))


@pytest.mark.parametrize(("window", "first"), [(16, 0), (17, 0), (18, 1), (19, 1)])
def test_a_centre_on_a_border_belongs_to_the_right(window: int, first: int) -> None:
    """An odd window about an even array puts pixel centres on the borders of cells."""
    layout = CellLayout(lens_rows=1, lens_cols=2, px_per_lens=8)
    shown = to_device(coded_by_lens(layout), layout, px_per_lens_device=8.0, window=(8, window))[0, :, 0]
    np.testing.assert_array_equal(shown[first : first + 16], [1] * 8 + [2] * 8)
    assert shown.sum() == 24


def test_a_margin_is_dark_and_lies_all_round() -> None:
    layout = CellLayout(lens_rows=1, lens_cols=2, px_per_lens=3)
    shown = to_device(np.ones((3, 6, 1)), layout, px_per_lens_device=3.0, margin_px=2)
    assert shown.shape == (7, 10, 1)
    assert shown[2:5, 2:8].all()
    assert shown.sum() == 18


@given(layout=LAYOUTS, d=st.floats(1, 30))
def test_without_a_window_the_size_is_the_nearest_whole_one(layout: CellLayout, d: float) -> None:
    rows, cols = device_size(layout, px_per_lens_device=d)
    height = layout.lens_rows if layout.lattice == "square" else (layout.lens_rows + 1 / 3) * ROW_PITCH
    assert abs(rows - height * d) <= 0.5 + 1e-9
    assert abs(cols - layout.cols / layout.px_per_lens * d) <= 0.5 + 1e-9


def test_a_window_too_small_for_the_array_is_refused() -> None:
    layout = CellLayout(lens_rows=100, lens_cols=100, px_per_lens=24)
    with pytest.raises(LayoutError, match=r"window of at least 2362 x 2362 px for .* at 23.622 .*, got 2362 x 2361"):
        device_size(layout, px_per_lens_device=AT_600_DPI, window=(2362, 2361))


@pytest.mark.parametrize(("d", "margin_px"), [(0.0, 0), (-1.0, 0), (math.nan, 0), (math.inf, 0), (8.0, -1)])
def test_an_impossible_grid_is_refused(d: float, margin_px: int) -> None:
    with pytest.raises(LayoutError, match="positive number of device px per lens"):
        device_size(CellLayout(1, 1, 8), px_per_lens_device=d, margin_px=margin_px)


def test_a_sheet_of_another_layout_is_refused() -> None:
    with pytest.raises(LayoutError, match="do not divide among"):
        to_device(np.zeros((8, 9, 3)), CellLayout(1, 1, 8), px_per_lens_device=8.0)
