"""SPOC: at no distance the half-turn, and elsewhere what stands in the reference plane stays there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.unit.integral.sheets import CHANNELS, DTYPES, SQUARE_LAYOUTS, numbered_sheet
from tests.unit.integral.textures import sheet_of_texture
from worker.errors import LayoutError
from worker.integral.layout import CellLayout
from worker.integral.orthoscopic import half_turn_cells
from worker.integral.spoc import PinholeArray, spoc

CAPTURE = PinholeArray(CellLayout(41, 41, 32), pitch_mm=1.0, gap_mm=3.3)


@given(
    layout=SQUARE_LAYOUTS, channels=CHANNELS, dtype=DTYPES, pitch_mm=st.floats(0.1, 5), gap_mm=st.floats(0.5, 10),
    reference_mm=st.floats(1, 100) | st.floats(-100, -1),
)  # fmt: skip
def test_at_no_distance_with_the_same_array_it_is_the_half_turn(
    layout: CellLayout, channels: int, dtype: type, pitch_mm: float, gap_mm: float, reference_mm: float
) -> None:
    array = PinholeArray(layout, pitch_mm=pitch_mm, gap_mm=gap_mm)
    sheet = numbered_sheet(layout, channels, dtype)
    turned = spoc(sheet, array, array, distance_mm=0.0, reference_mm=reference_mm)
    assert turned.dtype == sheet.dtype
    np.testing.assert_array_equal(turned, half_turn_cells(sheet, layout))


def bumps(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Light that is not the same when turned or mirrored."""
    return 1.5 + np.sin(x / 3 + 0.4) * np.cos(y / 4 - 0.7)


@pytest.mark.parametrize("depth_mm", [30.0, -20.0])
@pytest.mark.parametrize("distance_mm", [0.0, 10.0, -15.0])
@pytest.mark.parametrize(
    "display",
    [
        CAPTURE,
        PinholeArray(CellLayout(20, 23, 16), pitch_mm=1.0, gap_mm=3.3),
        PinholeArray(CellLayout(25, 20, 12), pitch_mm=0.8, gap_mm=4.0),
    ],
    ids=["the same", "other pixels and count", "other pitch and gap"],
)
def test_what_is_in_the_reference_plane_is_as_far_from_the_display_as_it_should_be(
    display: PinholeArray, distance_mm: float, depth_mm: float
) -> None:
    seen = sheet_of_texture(CAPTURE.layout, bumps, depth_mm, focal_mm=CAPTURE.gap_mm)
    found = spoc(
        half_turn_cells(seen, CAPTURE.layout), CAPTURE, display, distance_mm=distance_mm, reference_mm=depth_mm
    )
    expected = sheet_of_texture(
        display.layout, bumps, depth_mm - distance_mm, pitch_mm=display.pitch_mm, focal_mm=display.gap_mm
    )
    lit = found > 0
    assert lit.mean() > 0.5
    # Half a pixel of the capture is 0.14 mm in the reference plane at 30 mm, and light changes by 1 / 3 a mm at most.
    assert np.abs(found - expected)[lit].max() < 0.1


def test_what_the_capture_has_no_light_for_is_dark() -> None:
    wide = PinholeArray(CellLayout(3, 9, 4), pitch_mm=1.0, gap_mm=3.3)
    narrow = PinholeArray(CellLayout(3, 3, 4), pitch_mm=1.0, gap_mm=3.3)
    sheet = np.ones((12, 12, 1), dtype=np.float32)
    found = spoc(sheet, narrow, wide, distance_mm=0.0, reference_mm=10.0)
    np.testing.assert_array_equal(found[:, :, 0].any(axis=0), [3 <= col // 4 < 6 for col in range(36)])


@pytest.mark.parametrize(("distance_mm", "reference_mm"), [(0.0, 0.0), (math.nan, 1.0), (0.0, math.inf)])
def test_a_reference_plane_in_the_array_is_refused(distance_mm: float, reference_mm: float) -> None:
    with pytest.raises(LayoutError, match="expected a distance, and a reference plane off the capture's array"):
        spoc(np.ones((1312, 1312, 1)), CAPTURE, CAPTURE, distance_mm=distance_mm, reference_mm=reference_mm)


def test_hexagons_and_what_is_no_length_are_refused() -> None:
    with pytest.raises(LayoutError, match="expected a square lattice"):
        PinholeArray(CellLayout(3, 3, 4, lattice="hexagonal"), pitch_mm=1.0, gap_mm=3.3)
    with pytest.raises(LayoutError, match="expected a positive pitch and gap"):
        PinholeArray(CellLayout(3, 3, 4), pitch_mm=1.0, gap_mm=0.0)
    with pytest.raises(LayoutError, match="do not divide among"):
        spoc(np.ones((4, 4, 1)), CAPTURE, CAPTURE, distance_mm=0.0, reference_mm=1.0)
