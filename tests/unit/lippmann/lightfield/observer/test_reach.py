"""How far an eye may move so that all lenses show it their own light."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.observer.reach import ENDLESS_MM, reach_mm
from lippmann.lightfield.views.perspective import Eye, perspective, places_px
from lippmann.lightfield.views.views import view
from tests.unit.lippmann.lightfield.sheets import HEXAGONAL_LAYOUTS, SQUARE_LAYOUTS, image_of, numbered_sheet

LAYOUT = CellLayout(lens_rows=5, lens_cols=7, px_per_lens=6)
ARRAY = {"pitch_mm": 1.5, "gap_mm": 4.0}
LAYOUTS = (SQUARE_LAYOUTS | HEXAGONAL_LAYOUTS).filter(lambda layout: layout.px_per_lens > 1)


def test_endlessly_far_away_it_goes_from_the_first_view_to_the_last() -> None:
    image = image_of(numbered_sheet(LAYOUT), LAYOUT, pitch_mm=1.5, focal_length_mm=4.0)
    right_mm, up_mm = reach_mm(LAYOUT, ENDLESS_MM, **ARRAY)
    for along, u, v in ((1, 5, 0), (-1, 0, 5)):
        eye = Eye(along * right_mm, along * up_mm, ENDLESS_MM)
        np.testing.assert_allclose(perspective(image, eye).picture, view(image.pixels, LAYOUT, u, v))


@given(layout=LAYOUTS, times=st.floats(1, 50), side=st.sampled_from([-1, 1]))
def test_the_outermost_lens_just_shows_its_outermost_pixel(layout: CellLayout, times: float, side: int) -> None:
    with pytest.raises(LayoutError, match=r"an eye at least [\d.]+ mm away.* got -1 mm") as refused:
        reach_mm(layout, -1.0, **ARRAY)
    least_mm = float(str(refused.value).split("at least ")[1].split(" ")[0])
    distance_mm = max(1.0, least_mm * times * 1.001)
    right_mm, up_mm = reach_mm(layout, distance_mm, **ARRAY)
    outermost = (layout.px_per_lens - 1) / 2
    right, _ = places_px(layout, Eye(side * right_mm, 0, distance_mm), **ARRAY)
    assert np.abs(right).max() == pytest.approx(outermost, abs=1e-4)
    _, down = places_px(layout, Eye(0, side * up_mm, distance_mm), **ARRAY)
    row_mm = 1.5 * (1 if layout.lattice == "square" else 3**0.5 / 2) / layout.row_px
    assert np.abs(down).max() * row_mm == pytest.approx(outermost * 1.5 / layout.px_per_lens, rel=1e-4)


def test_an_eye_too_near_to_see_all_lenses_is_refused() -> None:
    # Half the array is 4.5 mm wide, at a slope of 1.5 / 8 x 5 / 6.
    with pytest.raises(LayoutError, match=r"at least 28\.8 mm away, which sees light of all lenses, got 20 mm"):
        reach_mm(LAYOUT, 20.0, **ARRAY)
