"""Two eyes as one picture, and the ways of a moving eye."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.job.optics.viewing import EyePath
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.observer.moving_eye import moving_eye
from lippmann.lightfield.observer.observe import observe, own_share, whole_window
from lippmann.lightfield.observer.stereo import eye_pair, together
from lippmann.lightfield.observer.viewing_conditions import ViewingConditions, least_own_share, observed_picture
from lippmann.lightfield.views.perspective import Eye
from tests.unit.lippmann.lightfield.displays import display_of
from tests.unit.lippmann.lightfield.sheets import numbered_sheet

LAYOUT = CellLayout(5, 6, 4)
PLACE = Eye(3.0, 2.0, 200.0)


def test_two_eyes_stand_beside_their_middle() -> None:
    left, right = eye_pair(PLACE, apart_mm=63.0)
    assert (left, right) == (Eye(-28.5, 2.0, 200.0), Eye(34.5, 2.0, 200.0))


def test_looking_with_two_eyes_is_looking_twice() -> None:
    sheet, display = numbered_sheet(LAYOUT), display_of(LAYOUT)
    window = whole_window(display, size_px=30)
    left, right = (
        observe(sheet, display, eye, pupil_mm=3.0, focus_mm=5.0, rays=4, window=window) for eye in eye_pair(PLACE)
    )
    how: dict[str, Any] = {"pupil_mm": 3.0, "focus_mm": 5.0, "rays": 4}
    pair = observed_picture(sheet, display, PLACE, ViewingConditions(**how, stereo="side_by_side"), window=window)
    np.testing.assert_array_equal(pair, np.concatenate((left, right), axis=1))
    crossed = observed_picture(sheet, display, PLACE, ViewingConditions(**how, stereo="cross_eyed"), window=window)
    np.testing.assert_array_equal(crossed, np.concatenate((right, left), axis=1))
    conditions = ViewingConditions(stereo="anaglyph")
    assert least_own_share(display, PLACE, conditions) == min(own_share(display, eye) for eye in eye_pair(PLACE))


@given(grey=st.floats(0, 1))
def test_an_anaglyph_of_equal_greys_is_that_grey(grey: float) -> None:
    picture = np.full((2, 3, 3), grey, dtype=np.float32)
    np.testing.assert_allclose(together(picture, picture, "anaglyph"), grey, atol=2e-3)


def test_an_anaglyph_shows_red_glass_the_left_eyes_light_and_cyan_glass_the_right_ones() -> None:
    white, black = np.ones((1, 1, 3)), np.zeros((1, 1, 3))
    left = together(white, black, "anaglyph")[0, 0]
    right = together(black, white, "anaglyph")[0, 0]
    assert left[0] > 1.0 > 0.0 > max(left[1:])
    assert min(right[1:]) > 1.0 > 0.0 > right[0]


@pytest.mark.parametrize("path", ["horizontal", "vertical", "circle", "toward", "still"])
@given(count=st.integers(1, 40), periods=st.integers(1, 3))
def test_a_moving_eye_comes_round(path: EyePath, count: int, periods: int) -> None:
    once = list(moving_eye(PLACE, path=path, reach_mm=30.0, count=count))
    often = list(moving_eye(PLACE, path=path, reach_mm=30.0, count=count * periods, periods=periods))
    assert len(often) == count * periods
    for number, eye in enumerate(often):
        first = once[number % count]
        same = pytest.approx((first.x_mm, first.y_mm, first.distance_mm), abs=1e-9)
        assert (eye.x_mm, eye.y_mm, eye.distance_mm) == same
        assert math.dist((eye.x_mm, eye.y_mm, eye.distance_mm), (3.0, 2.0, 200.0)) <= 30.0 + 1e-9


def test_the_ways_of_an_eye() -> None:
    def places(path: EyePath) -> list[tuple[float, float, float]]:
        eyes = moving_eye(PLACE, path=path, reach_mm=30.0, count=4)
        return [(round(eye.x_mm, 9), round(eye.y_mm, 9), round(eye.distance_mm, 9)) for eye in eyes]

    assert places("horizontal") == [(3, 2, 200), (33, 2, 200), (3, 2, 200), (-27, 2, 200)]
    assert places("vertical") == [(3, 2, 200), (3, 32, 200), (3, 2, 200), (3, -28, 200)]
    assert places("circle") == [(33, 2, 200), (3, 32, 200), (-27, 2, 200), (3, -28, 200)]
    assert places("toward") == [(3, 2, 200), (3, 2, 185), (3, 2, 170), (3, 2, 185)]


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(LayoutError, match="expected a positive distance between the eyes in mm, got 0"):
        eye_pair(PLACE, apart_mm=0.0)
    with pytest.raises(LayoutError, match="comes nearer by less than its distance, 200 mm, got 200"):
        moving_eye(PLACE, path="toward", reach_mm=200.0, count=4)
    with pytest.raises(LayoutError, match="expected a reach in mm, got nan"):
        moving_eye(PLACE, path="horizontal", reach_mm=math.nan, count=4)
    with pytest.raises(LayoutError, match="of one shape"):
        together(np.ones((2, 2, 3)), np.ones((2, 3, 3)), "anaglyph")
    with pytest.raises(LayoutError, match="expected red, green and blue for an anaglyph, got 1"):
        together(np.ones((2, 2, 1)), np.ones((2, 2, 1)), "anaglyph")
