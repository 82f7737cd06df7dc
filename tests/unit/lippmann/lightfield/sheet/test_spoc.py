"""SPOC: with equal arrays the half-turn, and on any display points and planes are where they should be."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.bands import HeldRows, SheetOfRows, stitched
from lippmann.lightfield.sheet.orthoscopic import half_turn_cells
from lippmann.lightfield.sheet.pinholes import PinholeArray
from lippmann.lightfield.sheet.spoc import SpocSheet
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view, view_numbers
from tests.unit.lippmann.lightfield.sheets import CHANNELS, DTYPES, LAYOUTS, lens_numbers, numbered_sheet
from tests.unit.lippmann.lightfield.textures import Texture, sheet_of_texture

SQUARE = PinholeArray(CellLayout(31, 31, 24), pitch_mm=1.0, gap_mm=3.3)
HEXAGONAL = PinholeArray(CellLayout(35, 31, 24, "hexagonal"), pitch_mm=1.0, gap_mm=3.3)
CAPTURES = pytest.mark.parametrize("capture", [SQUARE, HEXAGONAL], ids=["square capture", "hexagonal capture"])
DISPLAYS = pytest.mark.parametrize(
    "display",
    [
        SQUARE,
        HEXAGONAL,
        PinholeArray(CellLayout(15, 18, 16), pitch_mm=1.0, gap_mm=3.3),
        PinholeArray(CellLayout(21, 18, 12), pitch_mm=0.8, gap_mm=4.0),
        PinholeArray(CellLayout(21, 18, 12, "hexagonal", first_row_shifted=True), pitch_mm=0.8, gap_mm=4.0),
    ],
    ids=["square", "hexagonal", "other pixels and count", "other pitch and gap", "the same, hexagonal"],
)


def spoc(
    sheet: np.ndarray, capture: PinholeArray, display: PinholeArray, distance_mm: float, reference_mm: float,
    band_px: int = 10**9,
) -> np.ndarray:  # fmt: skip
    made = SpocSheet(SheetOfRows(HeldRows(sheet), capture.layout), capture, display, distance_mm, reference_mm)
    return np.concatenate(list(stitched(made, band_px)))


def captured(array: PinholeArray, texture: Texture, depth_mm: float) -> np.ndarray:
    shown = sheet_of_texture(array.layout, texture, depth_mm, pitch_mm=array.pitch_mm, focal_mm=array.gap_mm)
    return half_turn_cells(shown, array.layout)


@given(
    layout=LAYOUTS, channels=CHANNELS, dtype=DTYPES, pitch_mm=st.floats(0.1, 5), gap_mm=st.floats(0.5, 10),
    reference_mm=st.floats(1, 100) | st.floats(-100, -1), band_px=st.integers(1, 2000),
)  # fmt: skip
def test_at_no_distance_with_the_same_array_it_is_the_half_turn(
    layout: CellLayout, channels: int, dtype: type, pitch_mm: float, gap_mm: float, reference_mm: float, band_px: int
) -> None:
    array = PinholeArray(layout, pitch_mm=pitch_mm, gap_mm=gap_mm)
    sheet = numbered_sheet(layout, channels, dtype)
    turned = spoc(sheet, array, array, 0.0, reference_mm, band_px)
    assert turned.dtype == sheet.dtype
    np.testing.assert_array_equal(turned, half_turn_cells(sheet, layout))


@given(
    capture=LAYOUTS, display=LAYOUTS, pitch_mm=st.floats(0.5, 2), distance_mm=st.floats(-20, 20),
    reference_mm=st.floats(1, 50) | st.floats(-50, -1), band_px=st.integers(1, 2000),
)  # fmt: skip
def test_in_bands_it_is_what_it_is_whole_and_dark_beside_the_lenses(
    capture: CellLayout, display: CellLayout, pitch_mm: float, distance_mm: float, reference_mm: float, band_px: int
) -> None:
    here, there = PinholeArray(capture, 1.0, 3.3), PinholeArray(display, pitch_mm, 3.0)
    sheet = numbered_sheet(capture, 1)
    whole = spoc(sheet, here, there, distance_mm, reference_mm)
    np.testing.assert_array_equal(spoc(sheet, here, there, distance_mm, reference_mm, band_px), whole)
    assert not whole[lens_numbers(display) < 0].any()
    assert np.isin(whole, [0, *np.unique(sheet)]).all()


def bumps(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Light that is not the same when turned or mirrored."""
    return 1.5 + np.sin(x / 3 + 0.4) * np.cos(y / 4 - 0.7)


@CAPTURES
@DISPLAYS
@pytest.mark.parametrize(("depth_mm", "distance_mm"), [(20.0, 0.0), (20.0, 10.0), (-15.0, -10.0)])
def test_what_is_in_the_reference_plane_comes_out_where_it_was(
    capture: PinholeArray, display: PinholeArray, distance_mm: float, depth_mm: float
) -> None:
    found = spoc(captured(capture, bumps, depth_mm), capture, display, distance_mm, depth_mm)
    expected = sheet_of_texture(
        display.layout, bumps, depth_mm - distance_mm, pitch_mm=display.pitch_mm, focal_mm=display.gap_mm
    )
    lit = found > 0
    assert lit.mean() > 0.5
    # Half a pixel of the capture is 0.13 mm in the reference plane at 20 mm, and light changes by 1 / 3 a mm at most.
    assert np.abs(found - expected)[lit].max() < 0.06


def point_at(x_mm: float, y_mm: float) -> Texture:
    return lambda x, y: np.exp(-((x - x_mm) ** 2 + (y - y_mm) ** 2) / (2 * 0.7**2))


def disparity(sheet: np.ndarray, array: PinholeArray) -> float:
    """Return by how many pitches a single point moves to the left from one view to the next on the right."""
    layout, places = array.layout, []
    middle = layout.cell_rows // 2
    for u, v in view_numbers(layout):
        light = as_square(view(sheet, layout, u, v), layout)[..., 0].astype(np.float64)
        if v == middle and light.max() > 0.5:
            across = light.sum(axis=0)
            places.append((u, (across * np.arange(across.size)).sum() / across.sum()))
    assert len(places) > layout.cell_cols / 2
    u, col = np.array(places).T
    return -float(np.polyfit(u, col, 1)[0])


@CAPTURES
@DISPLAYS
@pytest.mark.parametrize(
    ("depth_mm", "distance_mm", "beside_mm"),
    [(8.0, 0.0, 0.0), (14.0, -6.0, 0.0), (-12.0, -6.0, 0.0), (10.0, -6.0, 4.0)],
)
def test_a_point_moves_as_its_depth_before_the_new_display_asks_for(
    capture: PinholeArray, display: PinholeArray, depth_mm: float, distance_mm: float, beside_mm: float
) -> None:
    reference_mm = depth_mm + beside_mm
    capture = replace(capture, layout=replace(capture.layout, px_per_lens=48))
    found = spoc(captured(capture, point_at(1.0, -0.6), depth_mm), capture, display, distance_mm, reference_mm)
    theory = (depth_mm - distance_mm) / (display.gap_mm * display.layout.px_per_lens)
    # What is taken is up to half a pixel of the capture beside the ray, in the reference plane; and for points beside
    # that plane from a lens up to half a pitch beside it. An error within e at every one of n views changes the slope
    # of a line through them by 3 e / n at most.
    half_px_mm = 0.5 * capture.pixel_mm[1] * abs(reference_mm) / capture.gap_mm
    half_pitch_mm = 0.5 * capture.pitch_mm * abs(depth_mm / reference_mm - 1)
    most = 3 * (half_px_mm + half_pitch_mm) / display.pitch_mm / display.layout.px_per_lens
    assert disparity(found, display) == pytest.approx(theory, rel=0.01, abs=most)


@CAPTURES
def test_what_the_capture_has_no_light_for_is_dark_to_the_pixel(capture: PinholeArray) -> None:
    narrow = PinholeArray(replace(capture.layout, lens_rows=3, lens_cols=3, px_per_lens=4), 1.0, 3.3)
    wide = PinholeArray(replace(narrow.layout, lens_cols=9), 1.0, 3.3)
    layout = narrow.layout
    found = spoc(np.ones((layout.rows, layout.cols, 1), np.float32), narrow, wide, 0.0, 10.0)
    has_light = (lens_numbers(wide.layout) % 9 >= 3) & (lens_numbers(wide.layout) % 9 < 6)
    np.testing.assert_array_equal(found[..., 0] > 0, has_light & (lens_numbers(wide.layout) >= 0))


def test_planes_that_are_none_and_other_layouts_are_refused() -> None:
    sheet = SheetOfRows(HeldRows(np.ones((744, 744, 1))), SQUARE.layout)
    for distance_mm, reference_mm, said in [
        (0.0, 0.0, "a reference plane in mm off the capture's own array, at 0, got 0"),
        (math.nan, 1.0, "a distance of the display in mm, got nan"),
        (0.0, math.inf, "a reference plane in mm off the capture's own array, at 0, got inf"),
    ]:
        with pytest.raises(LayoutError, match=said):
            SpocSheet(sheet, SQUARE, SQUARE, distance_mm, reference_mm)
    with pytest.raises(LayoutError, match="expected a sheet of 31 x 35 hexagonal lenses of 24 px, got one of 31 x 31"):
        SpocSheet(sheet, HEXAGONAL, SQUARE, 0.0, 1.0)


@pytest.mark.parametrize(
    ("pitch_mm", "gap_mm", "what"), [(0.0, 1.0, "pitch"), (1.0, -1.0, "gap"), (1.0, math.nan, "gap")]
)
def test_what_is_no_length_is_refused(pitch_mm: float, gap_mm: float, what: str) -> None:
    with pytest.raises(LayoutError, match=f"expected a positive {what} in mm"):
        PinholeArray(CellLayout(3, 3, 4), pitch_mm=pitch_mm, gap_mm=gap_mm)
