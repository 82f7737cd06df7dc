"""Depth-focused views: patches that join up at their depth, at more pixels than lenses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.refocus.depth_focused_view import depth_focused_view
from lippmann.lightfield.sheet.cells import cells, sheet_of
from lippmann.lightfield.sheet.orthoscopic import half_turn_cells
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view, view_numbers
from tests.unit.lippmann.lightfield.sheets import HEXAGONAL_LAYOUTS, LAYOUTS, SQUARE_LAYOUTS, image_of, numbered_sheet
from tests.unit.lippmann.lightfield.textures import sheet_of_texture

SQUARE = CellLayout(12, 14, 8)
HEXAGONAL = CellLayout(14, 12, 8, lattice="hexagonal")
FOCAL_MM = 3.3
MANY_LENSES = LAYOUTS.filter(lambda layout: min(layout.square_size()) > 2)
BOTH = pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL], ids=str)


def depth_of_patch(patch: float, layout: CellLayout) -> float:
    return FOCAL_MM * layout.px_per_lens / patch


def fine(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Light with detail between lenses of 1 mm, which no view can show."""
    light: np.ndarray = 1 + 0.5 * np.sin(7 * x + 1) * np.cos(5 * y) + 0.1 * x
    return light


def at_pixels(layout: CellLayout, px: int) -> tuple[np.ndarray, np.ndarray]:
    """Return where a picture's pixels are, (x, y) mm from the middle of an array of 1 mm lenses."""
    rows, cols = layout.square_size(px)
    y, x = np.mgrid[:rows, :cols].astype(float)
    return (x - (cols - 1) / 2) / px, (y - (rows - 1) / 2) / px


@given(layout=MANY_LENSES, px_of_patch=st.floats(0.6, 1.0), sign=st.sampled_from([-1, 1]), data=st.data())
def test_with_a_patch_of_one_pixel_it_is_the_view(
    layout: CellLayout, px_of_patch: float, sign: int, data: st.DataObject
) -> None:
    depth_mm = sign * depth_of_patch(px_of_patch, layout)
    u, v = data.draw(st.sampled_from(view_numbers(layout)))
    ortho = numbered_sheet(layout)
    found = depth_focused_view(image_of(ortho, layout, focal_length_mm=FOCAL_MM), depth_mm, direction=(u, v))
    np.testing.assert_allclose(found, as_square(view(ortho, layout, u, v), layout), rtol=1e-6)


@given(layout=SQUARE_LAYOUTS)
def test_a_patch_of_the_whole_cell_is_the_sheet_behind_and_its_half_turn_in_front(layout: CellLayout) -> None:
    ortho = numbered_sheet(layout)
    assume(min(layout.lens_rows, layout.lens_cols) > 1)
    n = layout.px_per_lens
    behind = depth_focused_view(image_of(ortho, layout, focal_length_mm=FOCAL_MM), -FOCAL_MM, px_per_lens=n)
    if n > 1:  # with one pixel a lens it is the middle view
        np.testing.assert_allclose(behind, ortho, rtol=1e-6)
        front = depth_focused_view(image_of(ortho, layout, focal_length_mm=FOCAL_MM), FOCAL_MM, px_per_lens=n)
        np.testing.assert_allclose(front, half_turn_cells(ortho, layout), rtol=1e-6)


@pytest.mark.parametrize("patch", [2, 3, 4, 6])
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_plane_comes_out_as_it_is_where_the_patch_is_of_whole_pixels(patch: int, sign: int) -> None:
    depth_mm = sign * depth_of_patch(patch, SQUARE)
    ortho = sheet_of_texture(SQUARE, fine, depth_mm, focal_mm=FOCAL_MM)
    # An odd patch stands about a pixel, an even one between two.
    direction = (4.0, 4.0) if patch % 2 else (3.5, 3.5)
    found = depth_focused_view(image_of(ortho, SQUARE, focal_length_mm=FOCAL_MM), depth_mm, direction=direction)
    assert found.shape == (SQUARE.lens_rows * patch, SQUARE.lens_cols * patch, 1)
    # A view to the right of the middle sees the plane moved; half a view, half of 1 / patch lenses.
    moved = sign * (direction[0] - 3.5) / patch
    x, y = at_pixels(SQUARE, patch)
    np.testing.assert_allclose(found[:, :, 0], fine(x + moved, y + moved), atol=1e-5)


@BOTH
@pytest.mark.parametrize("patch", [1.7, 2.5, 3.4])
@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("direction", [None, (4.3, 3.9)])
def test_a_slope_comes_out_as_it_is_at_any_patch(
    layout: CellLayout, patch: float, sign: int, direction: tuple[float, float] | None
) -> None:
    depth_mm = sign * depth_of_patch(patch, layout)
    ortho = sheet_of_texture(layout, lambda x, y: 9 + 0.3 * x - 0.2 * y, depth_mm, focal_mm=FOCAL_MM)
    found = depth_focused_view(
        image_of(ortho, layout, focal_length_mm=FOCAL_MM), depth_mm, direction=direction, px_per_lens=5
    )[:, :, 0]
    x, y = at_pixels(layout, 5)
    middle = (layout.cell_cols - 1) / 2, (layout.cell_rows - 1) / 2
    u, v = direction or middle
    height = 1.0 if layout.lattice == "square" else math.sqrt(3) / 2
    step = depth_mm / FOCAL_MM / layout.px_per_lens, depth_mm / FOCAL_MM / layout.row_px * height
    moved = step[0] * (u - middle[0]), step[1] * (v - middle[1])
    expected = 9 + 0.3 * (x + moved[0]) - 0.2 * (y + moved[1])
    lit = found > 0
    # Dark only in the dents of the hexagons' border.
    assert (~lit).mean() <= (0 if layout.lattice == "square" else 0.06)
    np.testing.assert_allclose(found[lit], expected[lit], atol=1e-4)


@BOTH
@pytest.mark.parametrize("sign", [-1, 1])
def test_it_shows_detail_between_lenses_that_the_view_does_not(layout: CellLayout, sign: int) -> None:
    depth_mm = sign * depth_of_patch(3.6, layout)
    ortho = sheet_of_texture(layout, fine, depth_mm, focal_mm=FOCAL_MM)
    found = depth_focused_view(image_of(ortho, layout, focal_length_mm=FOCAL_MM), depth_mm, px_per_lens=4)[:, :, 0]
    x, y = at_pixels(layout, 4)
    lit = found > 0
    wanted = fine(x, y)[lit]
    assert np.corrcoef(found[lit], wanted)[0, 1] > 0.99
    # The same as far off on the other side: every patch is the wrong way round.
    elsewhere = depth_focused_view(image_of(ortho, layout, focal_length_mm=FOCAL_MM), -depth_mm, px_per_lens=4)[:, :, 0]
    assert np.corrcoef(elsewhere[lit], wanted)[0, 1] < 0.8


@settings(deadline=None)  # a few hundred cells one by one, also on a busy machine
@given(layout=LAYOUTS | HEXAGONAL_LAYOUTS, patch=st.floats(1.2, 3.0), px=st.integers(2, 4), data=st.data())
def test_no_light_comes_from_another_cell(layout: CellLayout, patch: float, px: int, data: st.DataObject) -> None:
    assume(patch < layout.px_per_lens and min(layout.square_size()) > 1)
    rows, cols = layout.lens_rows, layout.lens_cols
    lit = data.draw(st.integers(0, rows - 1)), data.draw(st.integers(0, cols - 1))
    one_hot = np.zeros_like(cells(numbered_sheet(layout, 1), layout))
    one_hot[lit] = 1
    numbers = np.zeros_like(one_hot)
    numbers[...] = (np.arange(rows * cols).reshape(rows, cols) + 1)[:, :, None, None, None]
    depth_mm = depth_of_patch(patch, layout)
    shown, lens = (
        depth_focused_view(
            image_of(sheet_of(light, layout), layout, focal_length_mm=FOCAL_MM), depth_mm, px_per_lens=px
        )
        for light in (one_hot, numbers)
    )
    np.testing.assert_allclose(lens, np.round(lens), atol=1e-5)
    np.testing.assert_allclose(shown, np.round(lens) == lit[0] * cols + lit[1] + 1, atol=1e-6)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"depth_mm": 0.0}, r"a depth at least 3\.3 mm from the display for view \(3\.5, 3\.5\).*got 0 mm"),
        ({"depth_mm": -3.2}, r"at least 3\.3 mm .* got -3\.2 mm"),
        ({"depth_mm": 10.0, "direction": (7, 4)}, r"at least 26\.4 mm from the display for view \(7, 4\).*got 10 mm"),
        ({"depth_mm": 10.0, "direction": (8, 4)}, r"a view under a lens, from \(0, 0\) to \(7, 7\), got \(8, 4\)"),
        ({"depth_mm": 10.0, "direction": (math.nan, 4)}, r"a view under a lens, from \(0, 0\) to \(7, 7\), got \(nan"),
        ({"depth_mm": 10.0, "px_per_lens": 0}, "at least one pixel a lens, got 0"),
        ({"depth_mm": 1000.0}, "neighbouring views of 14 x 12 lenses of 8 px overlap"),
        ({"depth_mm": math.nan}, "expected a depth"),
    ],
    ids=str,
)
def test_what_cannot_be_is_refused_and_what_could_is_said(options: dict[str, Any], said: str) -> None:
    with pytest.raises(LayoutError, match=said):
        depth_focused_view(image_of(np.zeros((96, 112, 1)), SQUARE, focal_length_mm=FOCAL_MM), **options)


def test_a_hexagons_corner_view_does_not_exist() -> None:
    with pytest.raises(LayoutError, match=r"a view under a lens, from \(0, 0\) to \(7, 10\), got \(0, 0\)"):
        depth_focused_view(
            image_of(np.zeros((HEXAGONAL.rows, HEXAGONAL.cols, 1)), HEXAGONAL, focal_length_mm=FOCAL_MM),
            30.0,
            direction=(0, 0),
        )
