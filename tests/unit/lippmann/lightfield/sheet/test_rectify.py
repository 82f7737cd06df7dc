"""Sheets of any pitch, turned or not, made into whole cells: nothing passes from one cell into another."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.cell import Lattice
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.cell_sampling import Places, picture_places
from lippmann.lightfield.sheet.device import to_device
from lippmann.lightfield.sheet.lens_grid import LensGrid, device_grid, layout_grid
from lippmann.lightfield.sheet.rectify import rectify
from lippmann.lightfield.views.views import view, view_numbers
from tests.unit.lippmann.lightfield.sheets import LAYOUTS, lens_centres, lens_numbers, numbered_sheet, px_centres
from tests.unit.lippmann.lightfield.textures import sheet_of_texture

AT_600_DPI = 600 / 25.4
PITCHES = st.sampled_from([3.37, 7.992, AT_600_DPI])
TURNS = st.sampled_from([0.0, 0.4, -3.0, 45.0, 90.0, 180.0])
MANY_PX = LAYOUTS.filter(lambda layout: layout.px_per_lens > 1)
ROW_PITCH = math.sqrt(3) / 2


def scan_grid(layout: CellLayout, pitch_px: float, turn_deg: float) -> tuple[LensGrid, tuple[int, int]]:
    """Return a lattice somewhere in a picture that is large enough for it, and the picture's size."""
    side = math.ceil((max(layout.lens_rows, layout.lens_cols) + 2) * pitch_px * 3)
    grid = replace(layout_grid(layout), pitch_px=pitch_px, row_pitch_px=None, turn_deg=turn_deg)
    return replace(grid, offset_px=(side / 2 + 0.3, side / 2 - 0.7)), (side, side)


def lens_of_pixels(grid: LensGrid, size: tuple[int, int]) -> np.ndarray:
    """Return lens_row * lens_cols + lens_col of the lens each pixel's centre is nearest to, if it lies under it."""
    down, right = np.mgrid[: size[0], : size[1]] + 0.5
    rows, cols = np.mgrid[: grid.lens_rows, : grid.lens_cols]
    places = Places(rows.ravel(), cols.ravel(), np.array(0.0), np.array(0.0))
    nearest, number = np.full(size, np.inf), np.full(size, -1)
    for lens, (y, x) in enumerate(zip(*picture_places(grid, places), strict=True)):
        angle = math.radians(grid.turn_deg)
        dx = (right - x) * math.cos(angle) + (down - y) * math.sin(angle)
        dy = (down - y) * math.cos(angle) - (right - x) * math.sin(angle)
        across = np.abs(dy) if grid.lattice == "square" else np.abs(dx) / 2 + np.abs(dy) * ROW_PITCH
        away = np.maximum(np.abs(dx), across) / grid.pitch_px
        number[(away <= 0.5) & (away < nearest)] = lens
        nearest = np.minimum(nearest, away)
    return number


@given(layout=MANY_PX, dtype=st.sampled_from([np.float16, np.float32]))
def test_a_sheet_of_whole_cells_stays_as_it_is(layout: CellLayout, dtype: type) -> None:
    sheet = numbered_sheet(layout, 2, dtype)
    found = rectify(sheet, layout_grid(layout), layout)
    assert found.dtype == dtype
    np.testing.assert_array_equal(found, sheet)


@given(layout=LAYOUTS, pitch_px=PITCHES, n=st.sampled_from([2, 4, 8, 26]), turn_deg=TURNS)
def test_every_cell_shows_its_own_light_and_no_other(
    layout: CellLayout, pitch_px: float, n: int, turn_deg: float
) -> None:
    grid, size = scan_grid(layout, pitch_px, turn_deg)
    lens = lens_of_pixels(grid, size)
    picture = np.where(lens < 0, np.nan, lens + 1)[:, :, np.newaxis]
    asked = grid.layout(n)
    np.testing.assert_allclose(rectify(picture, grid, asked)[:, :, 0], lens_numbers(asked) + 1, rtol=1e-12)


@given(layout=LAYOUTS, pitch_px=PITCHES, data=st.data())
def test_one_lit_cell_on_a_devices_pixels_lights_that_cell_alone(
    layout: CellLayout, pitch_px: float, data: st.DataObject
) -> None:
    lit = data.draw(st.integers(0, layout.lens_rows * layout.lens_cols - 1))
    sheet = np.where(lens_numbers(layout) == lit, np.inf, 0.25)[:, :, np.newaxis].astype(np.float32)
    sheet[lens_numbers(layout) < 0] = 0
    shown = to_device(np.nan_to_num(sheet, posinf=7.0), layout, px_per_lens_device=pitch_px)
    # Infinitely bright in its own pixels: the least weight that any of them had elsewhere would show.
    shown[shown == 7.0] = np.inf
    back = rectify(shown, device_grid(layout, px_per_lens_device=pitch_px), layout)
    np.testing.assert_allclose(back, sheet, rtol=1e-6)


@given(layout=LAYOUTS, pitch_px=PITCHES, turn_deg=TURNS, n=st.sampled_from([4, 8]))
def test_a_ramp_across_every_cell_is_reproduced_but_for_its_outermost_pixels(
    layout: CellLayout, pitch_px: float, turn_deg: float, n: int
) -> None:
    grid, size = scan_grid(layout, pitch_px, turn_deg)
    down, right = np.mgrid[: size[0], : size[1]] + 0.5
    asked = grid.layout(n)
    found = rectify(np.stack((right, down), axis=-1), grid, asked)
    lens = lens_numbers(asked)
    x, y = np.meshgrid(*px_centres(asked))
    own = lens_centres(asked).reshape(-1, 2)[lens]
    places = Places(
        lens // asked.lens_cols, lens % asked.lens_cols, (y - own[..., 1]) * pitch_px, (x - own[..., 0]) * pitch_px
    )
    expected = np.stack(picture_places(grid, places)[::-1], axis=-1)
    off = np.abs(found - expected)[lens >= 0]
    # A pixel of the picture about a place is the lens's own where the place is sqrt 2 px inside.
    dx, dy = np.abs(places.right), np.abs(places.down)
    across = dy if asked.lattice == "square" else dx / 2 + dy * ROW_PITCH
    inner = (np.maximum(dx, across) <= pitch_px / 2 - math.sqrt(2))[lens >= 0]
    assert (off[inner] <= 1e-5).all()
    assert (off <= 2.0).all()


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_views_of_a_printed_sheet_are_the_views_that_were_printed(lattice: Lattice) -> None:
    layout = CellLayout(18, 20, 24, lattice=lattice)
    ortho = sheet_of_texture(layout, lambda x, y: 1 + np.sin(x) * np.cos(0.7 * y), 12.0, focal_mm=3.3)
    printed = to_device(ortho, layout, px_per_lens_device=AT_600_DPI, margin_px=5)
    back = rectify(printed, device_grid(layout, px_per_lens_device=AT_600_DPI, margin_px=5), layout)
    # In the hexagons' inner circle, a pixel inside: between pixels it is interpolated twice, and not held.
    middle_u, middle_v = (layout.cell_cols - 1) / 2, (layout.cell_rows - 1) / 2
    numbers = [(u, v) for u, v in view_numbers(layout) if math.hypot(u - middle_u, v - middle_v) <= 10.5]
    for u, v in numbers[::17]:
        np.testing.assert_allclose(view(back, layout, u, v), view(ortho, layout, u, v), atol=0.02)


def test_a_turned_lattice_lies_where_its_turn_says() -> None:
    grid = LensGrid(2, 2, 10.0, (20.0, 30.0), turn_deg=90.0)
    rows, cols = np.mgrid[:2, :2]
    down, right = picture_places(grid, Places(rows, cols, np.array(0.0), np.array(0.0)))
    # A quarter clockwise: what was to the right is below, what was below is to the left.
    np.testing.assert_allclose(down, [[20, 30], [20, 30]])
    np.testing.assert_allclose(right, [[30, 30], [20, 20]])


def test_a_lens_that_the_edge_cuts_goes_on_with_its_outermost_pixels() -> None:
    picture = np.array([[1.0, 2.0, 3.0, 4.0]]).repeat(4, axis=0)[:, :, np.newaxis]
    found = rectify(picture, LensGrid(1, 1, 4.0, (2.0, 1.0)))
    np.testing.assert_array_equal(found[:, :, 0], [[1, 1, 2, 3]] * 4)


@pytest.mark.parametrize(
    ("grid", "said"),
    [
        (LensGrid(3, 3, 4.0, (2.0, 2.0)), r"every lens's centre on the picture of 12 x 8 px, got lens \(0, 2\) at"),
        (LensGrid(2, 2, 4.0, (-1.0, 2.0)), r"got lens \(0, 0\) at \(-1\.0, 2\.0\) px for 2 x 2 lenses of 4 px"),
    ],
)
def test_a_lens_beyond_the_picture_is_named(grid: LensGrid, said: str) -> None:
    with pytest.raises(LayoutError, match=said):
        rectify(np.zeros((12, 8, 1)), grid)


@pytest.mark.parametrize(
    "wrong",
    [{"pitch_px": 0.0}, {"pitch_px": math.nan}, {"row_pitch_px": 0.0}, {"turn_deg": math.inf},
     {"offset_px": (0.0, math.nan)}],
    ids=str,
)  # fmt: skip
def test_what_is_no_lattice_is_refused(wrong: dict[str, Any]) -> None:
    right: dict[str, Any] = {"lens_rows": 2, "lens_cols": 2, "pitch_px": 4.0, "offset_px": (2.0, 2.0)}
    with pytest.raises(LayoutError, match="expected a pitch above 0 px both ways"):
        LensGrid(**{**right, **wrong})


def test_no_lenses_and_other_lenses_are_refused() -> None:
    with pytest.raises(LayoutError, match="expected at least one lens, got 2 x 0"):
        LensGrid(0, 2, 4.0, (2.0, 2.0))
    with pytest.raises(LayoutError, match="expected a layout of the same lenses as 2 x 2 lenses of 4 px"):
        rectify(np.zeros((8, 8, 1)), LensGrid(2, 2, 4.0, (2.0, 2.0)), CellLayout(2, 3, 4))
    with pytest.raises(LayoutError, match=r"expected lenses of at least 2 px both ways, got 1 x 1 lenses of 1\.9 px"):
        rectify(np.zeros((8, 8, 1)), LensGrid(1, 1, 1.9, (2.0, 2.0)))
    with pytest.raises(LayoutError, match="expected a picture"):
        rectify(np.zeros((8, 8)), LensGrid(2, 2, 4.0, (2.0, 2.0)))
