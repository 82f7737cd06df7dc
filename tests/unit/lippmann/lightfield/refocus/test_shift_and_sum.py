"""Refocus: laws of shift-and-sum, and a point that is sharpest where it is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.refocus.all_in_focus import all_in_focus, sharpness
from lippmann.lightfield.refocus.shift_and_sum import focal_stack, refocus, shifts
from lippmann.lightfield.sheet.orthoscopic import half_turn_cells
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view, view_numbers
from tests.unit.lippmann.lightfield.sheets import LAYOUTS, image_of, numbered_sheet
from tests.unit.lippmann.lightfield.textures import sheet_of_texture, spot

SQUARE = CellLayout(31, 31, 8)
HEXAGONAL = CellLayout(36, 31, 8, lattice="hexagonal")
FOCAL_MM = 3.3
DEPTHS_MM = st.floats(-10, 10, allow_subnormal=False)  # a subnormal depth moves nothing, and is not 0


def overlap(layout: CellLayout, depth_mm: float) -> bool:
    found = shifts(layout, depth_mm, focal_mm=FOCAL_MM)
    return all(abs(step) <= lenses - 1 for step, lenses in zip(found, layout.square_size(), strict=True))


@given(layout=LAYOUTS)
def test_at_depth_0_it_is_the_mean_of_the_views(layout: CellLayout) -> None:
    ortho = numbered_sheet(layout)
    views = [as_square(view(ortho, layout, u, v), layout) for u, v in view_numbers(layout)]
    np.testing.assert_allclose(
        refocus(image_of(ortho, layout, focal_length_mm=FOCAL_MM), 0.0), np.mean(views, axis=0), rtol=1e-5
    )


@given(layout=LAYOUTS, depth_mm=DEPTHS_MM)
def test_the_half_turn_of_the_cells_flips_the_depth(layout: CellLayout, depth_mm: float) -> None:
    assume(overlap(layout, depth_mm))
    ortho = numbered_sheet(layout)
    turned = refocus(image_of(half_turn_cells(ortho, layout), layout, focal_length_mm=FOCAL_MM), -depth_mm)
    np.testing.assert_allclose(turned, refocus(image_of(ortho, layout, focal_length_mm=FOCAL_MM), depth_mm), rtol=1e-4)


@given(layout=LAYOUTS, depth_mm=DEPTHS_MM)
def test_even_light_stays_even_at_every_depth(layout: CellLayout, depth_mm: float) -> None:
    assume(overlap(layout, depth_mm))
    even = np.full((layout.rows, layout.cols, 1), 0.25, dtype=np.float32)
    picture = refocus(image_of(even, layout, focal_length_mm=FOCAL_MM), depth_mm)
    np.testing.assert_allclose(picture, 0.25, rtol=1e-5)


@settings(deadline=None)  # up to four refocused pictures of 200 views, also on a busy machine
@given(layout=LAYOUTS, depths_mm=st.lists(DEPTHS_MM, min_size=1, max_size=3))
def test_a_stack_is_its_depths_one_by_one(layout: CellLayout, depths_mm: list[float]) -> None:
    assume(all(overlap(layout, depth_mm) for depth_mm in depths_mm))
    ortho = numbered_sheet(layout)
    stack = focal_stack(image_of(ortho, layout, focal_length_mm=FOCAL_MM), depths_mm)
    for depth_mm, picture in zip(depths_mm, stack, strict=True):
        # Sums in another order.
        np.testing.assert_allclose(
            picture, refocus(image_of(ortho, layout, focal_length_mm=FOCAL_MM), depth_mm), rtol=1e-6
        )


@settings(deadline=None)  # as above
@given(layout=LAYOUTS, depth_mm=DEPTHS_MM)
def test_it_is_the_views_shifted_and_added_one_by_one(layout: CellLayout, depth_mm: float) -> None:
    assume(overlap(layout, depth_mm))
    ortho = numbered_sheet(layout, 2, np.float64)
    down, across = shifts(layout, depth_mm, focal_mm=FOCAL_MM)
    added, counted = 0.0, 0.0
    for u, v in view_numbers(layout):
        picture = as_square(view(ortho, layout, u, v), layout)
        for axis, shift in enumerate(
            (down * ((layout.cell_rows - 1) / 2 - v), across * ((layout.cell_cols - 1) / 2 - u))
        ):
            picture = shifted(picture, round(shift * 2**20) / 2**20, axis)
        added = added + np.nan_to_num(picture)
        counted = counted + ~np.isnan(picture)
    np.testing.assert_allclose(
        refocus(image_of(ortho, layout, focal_length_mm=FOCAL_MM), depth_mm), added / counted, rtol=1e-9
    )


def shifted(picture: np.ndarray, shift: float, axis: int) -> np.ndarray:
    """Return a picture whose every pixel is what lies `shift` further along an axis; no number beyond the border."""
    at = np.arange(picture.shape[axis]) + shift
    lines = np.moveaxis(picture, axis, -1)
    moved = [np.interp(at, np.arange(at.size), line, np.nan, np.nan) for line in lines.reshape(-1, at.size)]
    return np.moveaxis(np.reshape(moved, lines.shape), -1, axis)


@pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL], ids=str)
@pytest.mark.parametrize("depth_mm", [30.0, -30.0])
def test_a_point_is_sharpest_at_its_depth(layout: CellLayout, depth_mm: float) -> None:
    ortho = sheet_of_texture(layout, spot, depth_mm, focal_mm=FOCAL_MM)
    depths_mm = np.arange(-40.0, 41.0, 2.0)
    stack = focal_stack(image_of(ortho, layout, focal_length_mm=FOCAL_MM), depths_mm.tolist())
    for measured in (stack.max(axis=(1, 2, 3)), [sharpness(picture, smooth_px=0).max() for picture in stack]):
        assert abs(depths_mm[np.argmax(measured)] - depth_mm) <= 2.0


@pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL], ids=str)
def test_all_in_focus_takes_each_point_from_its_depth(layout: CellLayout) -> None:
    ortho = sheet_of_texture(layout, lambda x, y: spot(x + 6, y), 20.0, focal_mm=FOCAL_MM)
    ortho += sheet_of_texture(layout, lambda x, y: spot(x - 6, y), -10.0, focal_mm=FOCAL_MM)
    depths_mm = np.arange(-20.0, 31.0, 5.0)
    stack = focal_stack(image_of(ortho, layout, focal_length_mm=FOCAL_MM), depths_mm.tolist())
    found = all_in_focus(stack)
    rows, cols = layout.square_size()
    for col, depth_mm in ((cols // 2 - 6, 20.0), (cols // 2 + 6, -10.0)):
        assert abs(depths_mm[found.nearest[rows // 2, col]] - depth_mm) <= 5.0
        assert found.picture[rows // 2, col, 0] > 0.5


def test_all_in_focus_compares_contrast_as_the_eye_sees_it() -> None:
    """A pattern in the dark, of less light than one in the bright, looks stronger and so counts as sharper."""
    row, col = np.mgrid[:12, :12]
    chequers = ((row + col) % 2)[..., np.newaxis].astype(np.float32)
    dark, bright = 0.04 * chequers, 0.88 + 0.06 * chequers
    found = all_in_focus(np.stack((bright, dark)))
    assert (found.nearest == 1).all()
    np.testing.assert_allclose(found.picture, dark, atol=0.01)


def test_all_in_focus_of_half_floats_is_added_up_in_single_precision() -> None:
    stack = np.full((7, 6, 5, 3), 0.1, dtype=np.float16)
    found = all_in_focus(stack).picture
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, np.float32(stack[0]), rtol=1e-6)


def test_all_in_focus_of_one_picture_is_the_picture() -> None:
    stack = np.random.default_rng(1).random((1, 4, 5, 3))
    np.testing.assert_array_equal(all_in_focus(stack).picture, stack[0])


def test_a_shift_is_s_by_n_f() -> None:
    assert shifts(SQUARE, 40.0, focal_mm=3.3) == pytest.approx((1.51515, 1.51515), abs=1e-5)
    down, across = shifts(HEXAGONAL, 40.0, focal_mm=3.3)
    assert (down, across) == pytest.approx((40 / 3.3 * math.sqrt(3) / 2 / 7, 1.51515), abs=1e-5)


@pytest.mark.parametrize("depth_mm", [1000.0, -1000.0])
def test_a_depth_at_which_no_views_overlap_is_refused_with_the_one_that_fits(depth_mm: float) -> None:
    with pytest.raises(LayoutError, match=r"at most 792 mm .* got -?1000 mm"):
        refocus(image_of(np.zeros((248, 248, 3), np.float32), SQUARE, focal_length_mm=3.3), depth_mm)


@pytest.mark.parametrize(("depth_mm", "focal_mm"), [(math.nan, 3.3), (math.inf, 3.3), (1.0, 0.0), (1.0, -1.0)])
def test_what_is_no_depth_or_focal_length_is_refused(depth_mm: float, focal_mm: float) -> None:
    with pytest.raises(LayoutError, match="expected a depth and a positive focal length"):
        shifts(SQUARE, depth_mm, focal_mm=focal_mm)


def test_what_is_no_sheet_or_stack_is_refused() -> None:
    with pytest.raises(LayoutError, match="do not divide among"):
        refocus(image_of(np.zeros((10, 10, 3), np.float32), SQUARE, focal_length_mm=3.3), 1.0)
    with pytest.raises(LayoutError, match="expected a stack"):
        all_in_focus(np.zeros((0, 4, 4, 3)))
