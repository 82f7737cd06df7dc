"""What an eye at a place sees."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.perspective import Eye, perspective, places_px
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view, view_numbers
from tests.unit.lippmann.lightfield.sheets import LAYOUTS, image_of, numbered_sheet
from tests.unit.lippmann.lightfield.textures import sheet_of_texture, spot

SQUARE = CellLayout(41, 41, 8)
HEXAGONAL = CellLayout(46, 41, 8, lattice="hexagonal")
ROW_PITCH = math.sqrt(3) / 2
FAR_MM = 1e12


@given(layout=LAYOUTS, data=st.data())
def test_from_infinitely_far_it_is_the_view(layout: CellLayout, data: st.DataObject) -> None:
    u, v = data.draw(st.sampled_from(view_numbers(layout)))
    ortho = numbered_sheet(layout)
    height = 1.0 if layout.lattice == "square" else ROW_PITCH
    right = (u - (layout.cell_cols - 1) / 2) / layout.px_per_lens
    down = (v - (layout.cell_rows - 1) / 2) / layout.row_px * height
    eye = Eye(right / 3.3 * FAR_MM, -down / 3.3 * FAR_MM, FAR_MM)
    found = perspective(image_of(ortho, layout, pitch_mm=1.0, focal_length_mm=3.3), eye)
    np.testing.assert_allclose(found.picture, view(ortho, layout, u, v), rtol=1e-6)
    assert found.seen.all()


@given(layout=LAYOUTS, x=st.floats(-50, 50), y=st.floats(-50, 50), distance=st.floats(5, 500))
def test_even_light_stays_even_where_it_is_seen_and_dark_elsewhere(
    layout: CellLayout, x: float, y: float, distance: float
) -> None:
    even = np.full((layout.rows, layout.cols, 2), 0.25, dtype=np.float32)
    found = perspective(image_of(even, layout, pitch_mm=1.0, focal_length_mm=3.3), Eye(x, y, distance))
    np.testing.assert_allclose(found.picture[found.seen], 0.25, rtol=1e-5)
    assert not found.picture[~found.seen].any()


@pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL], ids=str)
@pytest.mark.parametrize("depth_mm", [30.0, -30.0])
@pytest.mark.parametrize(("x_mm", "y_mm"), [(0.0, 0.0), (25.0, 0.0), (-25.0, 0.0), (0.0, 25.0), (20.0, -20.0)])
def test_a_point_is_seen_on_the_line_from_the_eye(
    layout: CellLayout, depth_mm: float, x_mm: float, y_mm: float
) -> None:
    ortho = sheet_of_texture(layout, spot, depth_mm, focal_mm=3.3)
    found = perspective(image_of(ortho, layout, pitch_mm=1.0, focal_length_mm=3.3), Eye(x_mm, y_mm, 400.0))
    light = as_square(found.picture, layout)[..., 0].astype(float)
    rows, cols = layout.square_size()
    row, col = np.mgrid[:rows, :cols]
    x = (light * (col - (cols - 1) / 2)).sum() / light.sum()
    y = -(light * (row - (rows - 1) / 2)).sum() / light.sum()
    crossing = -depth_mm / (400.0 - depth_mm)
    assert (x, y) == pytest.approx((x_mm * crossing, y_mm * crossing), abs=0.1)


@given(layout=LAYOUTS, x=st.floats(-50, 50), y=st.floats(-50, 50))
def test_every_lens_further_right_shows_a_place_further_right(layout: CellLayout, x: float, y: float) -> None:
    right, down = places_px(layout, Eye(x, y, 100.0), pitch_mm=1.0, gap_mm=3.3)
    assert (np.diff(right, axis=1) > 0).all()
    assert (np.diff(down, axis=0) > 0).all()


def test_an_eye_beyond_the_viewing_zone_sees_dark_lenses_at_the_far_side_only() -> None:
    ortho = np.ones((SQUARE.rows, SQUARE.cols, 1), dtype=np.float32)
    found = perspective(image_of(ortho, SQUARE, pitch_mm=1.0, focal_length_mm=3.3), Eye(60.0, 0.0, 400.0))
    # |60 - x| / 400 * 3.3 mm <= half a lens from x = -0.6 mm on.
    np.testing.assert_array_equal(found.seen, np.broadcast_to(np.arange(-20, 21) >= 0, (41, 41)))


def test_between_pixels_light_is_interpolated_and_held_at_the_cells_border() -> None:
    ortho = np.array([1.0, 3.0], dtype=np.float32).reshape(1, 2, 1).repeat(2, axis=0)
    for x, expected in ((0.0, 2.0), (25.0, 1.0), (-25.0, 3.0), (12.5, 1.5), (50.0, 1.0), (51.0, 0.0)):
        found = perspective(image_of(ortho, CellLayout(1, 1, 2), pitch_mm=1.0, focal_length_mm=1.0), Eye(x, 0.0, 100.0))
        assert found.picture[0, 0, 0] == pytest.approx(expected)


@pytest.mark.parametrize("distance_mm", [0.0, -400.0, math.nan, math.inf])
def test_an_eye_that_does_not_see_the_front_is_refused(distance_mm: float) -> None:
    with pytest.raises(LayoutError, match="expected an eye in front of the display"):
        Eye(0.0, 0.0, distance_mm)
