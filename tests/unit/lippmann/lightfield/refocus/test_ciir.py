"""CIIR: laws of cells magnified and laid over each other, and that it sees what shift-and-sum sees."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.refocus.ciir import ciir, ciir_stack
from lippmann.lightfield.refocus.shift_and_sum import refocus
from lippmann.lightfield.sheet.orthoscopic import half_turn_cells
from tests.unit.lippmann.lightfield.sheets import (
    LAYOUTS,
    ROW_PITCH,
    SQUARE_LAYOUTS,
    image_of,
    lens_centres,
    numbered_sheet,
)
from tests.unit.lippmann.lightfield.textures import sheet_of_texture, spot

SQUARE = CellLayout(31, 31, 8)
HEXAGONAL = CellLayout(37, 31, 8, lattice="hexagonal")
FOCAL_MM = 3.3
DEPTHS_MM = st.floats(-40, 40, allow_subnormal=False)  # a subnormal depth moves nothing, and is not 0
PX = st.integers(1, 9)


def ripples(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    light: np.ndarray = 1 + 0.3 * np.sin(x / 2) * np.cos(y / 3)
    return light


def overlap(layout: CellLayout, depth_mm: float) -> bool:
    """Return whether neighbouring views of the array share at least one lens, by the geometry of a pinhole array.

    Lengths are in pitches. The ray through a pixel and its pinhole moves by s / f of a pixel from one pixel to the next
    at depth s. A picture on square pixels, one a lens, is as high as all lens rows together, rounded.
    """
    row_pitch = 1.0 if layout.lattice == "square" else ROW_PITCH
    pixel_high, pixel_wide = row_pitch / layout.row_px, 1 / layout.px_per_lens
    high, wide = max(1, round(layout.lens_rows * row_pitch)), layout.lens_cols
    moves = abs(depth_mm) / FOCAL_MM
    # A single view in a direction has no neighbour there; its depth is not limited.
    return (layout.cell_rows == 1 or moves * pixel_high <= high - 1) and (
        layout.cell_cols == 1 or moves * pixel_wide <= wide - 1
    )


@given(layout=LAYOUTS, depth_mm=DEPTHS_MM)
def test_exactly_the_depths_at_which_neighbouring_views_overlap_are_accepted(
    layout: CellLayout, depth_mm: float
) -> None:
    image = image_of(np.ones((layout.rows, layout.cols, 1)), layout, focal_length_mm=FOCAL_MM)
    if overlap(layout, depth_mm):
        assert ciir(image, depth_mm, px_per_lens=1).shape == (*layout.square_size(1), 1)
    else:
        with pytest.raises(LayoutError, match="expected a depth at which neighbouring views"):
            ciir(image, depth_mm, px_per_lens=1)


def by_hand(sheet: np.ndarray, layout: CellLayout, depth_mm: float, px: int) -> np.ndarray:
    """Lay every pixel of every cell over the picture, one after the other, as a tent."""
    rows, cols = layout.square_size(px)
    row_pitch = 1.0 if layout.lattice == "square" else ROW_PITCH
    centres = (
        lens_centres(layout) - np.array([layout.cols / layout.px_per_lens, layout.rows / layout.row_px * row_pitch]) / 2
    )
    across, down = 1 / layout.px_per_lens, row_pitch / layout.row_px
    scale = depth_mm / FOCAL_MM
    reach = max(1 / px, 1 - abs(scale) * across * (layout.px_per_lens - 1))
    added, counted = np.zeros((rows, cols, sheet.shape[2])), np.zeros((rows, cols, 1))
    y, x = (np.arange(rows) - (rows - 1) / 2) / px, (np.arange(cols) - (cols - 1) / 2) / px
    for (lens_row, lens_col), _ in np.ndenumerate(centres[..., 0]):
        for row, col in np.argwhere(layout.mask):
            at_x, at_y = centres[lens_row, lens_col] - scale * np.array(
                [(col - (layout.cell_cols - 1) / 2) * across, (row - (layout.cell_rows - 1) / 2) * down]
            )
            tent_x = np.maximum(1 - np.abs(x - at_x) / max(reach, abs(scale) * across), 0)
            tent_y = np.maximum(1 - np.abs(y - at_y) / max(reach, abs(scale) * down), 0)
            tent = np.outer(tent_y, tent_x)[..., np.newaxis]
            px_row = lens_row * layout.row_px + row
            px_col = lens_col * layout.px_per_lens + layout.shift_px(lens_row) + col
            added += tent * sheet[px_row, px_col]
            counted += tent
    return np.divide(added, counted, out=np.zeros_like(added), where=counted > 1e-6)


@pytest.mark.parametrize(
    "layout", [CellLayout(4, 5, 3), CellLayout(5, 4, 4, "hexagonal", first_row_shifted=True)], ids=str
)
@pytest.mark.parametrize("depth_mm", [-9.0, -2.0, 1.0, 4.4, 12.0])
@pytest.mark.parametrize("px", [1, 3, 5])
def test_it_is_every_pixel_laid_down_by_hand(layout: CellLayout, depth_mm: float, px: int) -> None:
    sheet = np.random.default_rng(1).random((layout.rows, layout.cols, 2))
    found = ciir(image_of(sheet, layout, focal_length_mm=FOCAL_MM), depth_mm, px_per_lens=px)
    np.testing.assert_allclose(found, by_hand(sheet, layout, depth_mm, px), atol=1e-6)


@given(layout=LAYOUTS, depth_mm=DEPTHS_MM, px=PX)
def test_even_light_stays_even(layout: CellLayout, depth_mm: float, px: int) -> None:
    assume(overlap(layout, depth_mm))
    even = np.full((layout.rows, layout.cols, 1), 0.25, dtype=np.float32)
    picture = ciir(image_of(even, layout, focal_length_mm=FOCAL_MM), depth_mm, px_per_lens=px)
    assert picture.shape == (*layout.square_size(px), 1)
    # In the dents of a hexagonal border there may be no light.
    inside = picture if layout.lattice == "square" else picture[picture != 0]
    np.testing.assert_allclose(inside, 0.25, rtol=1e-5)
    dents = 0 if layout.lattice == "square" else 2 * (layout.square_size(px)[0] + layout.square_size(px)[1]) * px
    assert (picture == 0).sum() <= dents


@pytest.mark.parametrize("depth_mm", [-30.0, -5.0, -3.3, -1.0, 0.0, 0.5, 2.9, 3.3, 4.0, 40.0])
@pytest.mark.parametrize("px", [1, 8, 23])
def test_inside_a_hexagonal_array_no_pixel_is_dark(depth_mm: float, px: int) -> None:
    layout = CellLayout(9, 8, 8, lattice="hexagonal")
    picture = ciir(
        image_of(np.ones((layout.rows, layout.cols, 1)), layout, focal_length_mm=FOCAL_MM), depth_mm, px_per_lens=px
    )
    np.testing.assert_allclose(picture[px:-px, px:-px], 1.0)


@given(layout=SQUARE_LAYOUTS)
def test_in_the_plane_of_the_displays_pixels_it_is_the_sheet(layout: CellLayout) -> None:
    assume(overlap(layout, FOCAL_MM))
    ortho = numbered_sheet(layout)
    np.testing.assert_allclose(ciir(image_of(ortho, layout, focal_length_mm=FOCAL_MM), -FOCAL_MM), ortho, rtol=1e-5)
    turned = half_turn_cells(ortho, layout)
    np.testing.assert_allclose(ciir(image_of(ortho, layout, focal_length_mm=FOCAL_MM), FOCAL_MM), turned, rtol=1e-5)


@given(layout=LAYOUTS, depth_mm=DEPTHS_MM, px=PX)
def test_the_half_turn_of_the_cells_flips_the_depth(layout: CellLayout, depth_mm: float, px: int) -> None:
    assume(overlap(layout, depth_mm))
    ortho = numbered_sheet(layout)
    turned = ciir(image_of(half_turn_cells(ortho, layout), layout, focal_length_mm=FOCAL_MM), -depth_mm, px_per_lens=px)
    np.testing.assert_allclose(
        turned, ciir(image_of(ortho, layout, focal_length_mm=FOCAL_MM), depth_mm, px_per_lens=px), rtol=1e-4
    )


@given(layout=SQUARE_LAYOUTS, px=st.sampled_from([1, 3, 5]))
def test_at_depth_0_a_lens_centre_shows_the_mean_of_the_views(layout: CellLayout, px: int) -> None:
    ortho = numbered_sheet(layout)
    found = ciir(image_of(ortho, layout, focal_length_mm=FOCAL_MM), 0.0, px_per_lens=px)[px // 2 :: px, px // 2 :: px]
    np.testing.assert_allclose(found, refocus(image_of(ortho, layout, focal_length_mm=FOCAL_MM), 0.0), rtol=1e-5)


@pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL], ids=str)
@pytest.mark.parametrize(
    ("texture_mm", "depth_mm", "within"),
    [(12.0, 12.0, 0.02), (-12.0, -12.0, 0.02), (17.0, 30.0, 0.01), (17.0, -30.0, 0.01), (-17.0, 30.0, 0.01)],
)
def test_at_lens_centres_it_is_what_shift_and_sum_is(
    layout: CellLayout, texture_mm: float, depth_mm: float, within: float
) -> None:
    """Within the error of interpolation between lenses here, between pixels there.

    Out of focus both are means over rays, of every view or of every lens, and differ the less the more lenses overlap.
    """
    ortho = sheet_of_texture(layout, ripples, texture_mm, focal_mm=FOCAL_MM)
    summed = refocus(image_of(ortho, layout, focal_length_mm=FOCAL_MM), depth_mm)
    at_centres = ciir(image_of(ortho, layout, focal_length_mm=FOCAL_MM), depth_mm, px_per_lens=5)[2::5, 2::5]
    inner = slice(8, -8)
    np.testing.assert_allclose(at_centres[inner, inner], summed[inner, inner], atol=within)


@pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL], ids=str)
@pytest.mark.parametrize("depth_mm", [30.0, -30.0])
def test_a_point_is_brightest_at_its_depth(layout: CellLayout, depth_mm: float) -> None:
    ortho = sheet_of_texture(layout, spot, depth_mm, focal_mm=FOCAL_MM)
    depths_mm = np.arange(-40.0, 41.0, 2.0)
    stack = ciir_stack(image_of(ortho, layout, focal_length_mm=FOCAL_MM), depths_mm.tolist(), px_per_lens=2)
    assert abs(depths_mm[np.argmax(stack.max(axis=(1, 2, 3)))] - depth_mm) <= 2.0


def test_what_cannot_be_is_refused() -> None:
    sheet = np.zeros((SQUARE.rows, SQUARE.cols, 1), dtype=np.float32)
    with pytest.raises(LayoutError, match=r"at most 792 mm .* got 1000 mm"):
        ciir(image_of(sheet, SQUARE, focal_length_mm=FOCAL_MM), 1000.0)
    with pytest.raises(LayoutError, match="expected at least one pixel a lens, got 0"):
        ciir(image_of(sheet, SQUARE, focal_length_mm=FOCAL_MM), 10.0, px_per_lens=0)
    with pytest.raises(LayoutError, match="do not divide among"):
        ciir(image_of(sheet[:-1], SQUARE, focal_length_mm=FOCAL_MM), 10.0)
    with pytest.raises(LayoutError, match="expected a depth"):
        ciir(image_of(sheet, SQUARE, focal_length_mm=FOCAL_MM), math.nan)
