"""What an eye sees of a display: rays, lenses, pixels."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.observer.eye_rays import eye_rays
from lippmann.lightfield.observer.observe import observe, own_share, whole_window
from lippmann.lightfield.observer.window import Window, window_of
from lippmann.lightfield.sheet.cells import cells, sheet_of
from lippmann.lightfield.sheet.device import to_device
from lippmann.lightfield.views.perspective import Eye, perspective, places_px
from lippmann.optics.rig.display import viewing_zone_mm
from tests.unit.lippmann.lightfield.displays import F_MM, display_of
from tests.unit.lippmann.lightfield.sheets import LAYOUTS, ROW_PITCH, image_of, lens_centres, numbered_sheet

SQUARE = CellLayout(11, 13, 6)
HEXAGONAL = CellLayout(12, 13, 6, lattice="hexagonal")
BOTH = pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL], ids=str)


def interlocks(layout: CellLayout) -> bool:
    """Return whether every other lens row is shifted."""
    return layout.lattice == "hexagonal" and layout.lens_rows > 1


def at_lenses(layout: CellLayout) -> Window:
    """Return the window that has a pixel in the middle of every lens: `[:, ::2]` or, of shifted rows, `[:, 1::2]`."""
    if not interlocks(layout):
        return Window(layout.lens_rows, layout.lens_cols, wide_mm=layout.lens_cols, high_mm=layout.lens_rows)
    return Window(
        layout.lens_rows, 2 * layout.lens_cols, wide_mm=layout.lens_cols, high_mm=layout.lens_rows * ROW_PITCH
    )


def by_lens(picture: np.ndarray, layout: CellLayout) -> np.ndarray:
    """Return what the lenses' middles show of a picture `at_lenses`, `(lens_rows, lens_cols, channel)`."""
    if not interlocks(layout):
        return picture
    shifted = np.array([layout.shift_px(row) > 0 for row in range(layout.lens_rows)])
    return np.where(shifted[:, np.newaxis, np.newaxis], picture[:, 1::2], picture[:, ::2])


@given(
    layout=LAYOUTS, x=st.floats(-900, 900), y=st.floats(-900, 900), distance=st.floats(20, 900),
    gap=st.floats(0.5, 8), pupil=st.floats(0.1, 9), focus=st.floats(-1e5, 15),
    aperture=st.sampled_from(["full", "inscribed"]),
)  # fmt: skip
def test_even_light_is_seen_even_from_everywhere(
    layout: CellLayout, x: float, y: float, distance: float, gap: float, pupil: float, focus: float, aperture: Any
) -> None:
    display = display_of(layout, gap_mm=gap, aperture=aperture, surround="white")
    even = np.ones((layout.rows, layout.cols, 2), dtype=np.float32)
    seen = observe(
        even, display, Eye(x, y, distance), pupil_mm=pupil, focus_mm=focus, rays=12,
        window=whole_window(display, size_px=16),
    )  # fmt: skip
    np.testing.assert_allclose(seen, 1.0, rtol=1e-6)


@BOTH
@pytest.mark.parametrize(("gap_mm", "aperture"), [(2.2, "full"), (F_MM, "full"), (3.7, "full"), (3.7, "inscribed")])
def test_every_ray_goes_through_the_nearest_lens_to_the_pixel_behind_it(
    layout: CellLayout, gap_mm: float, aperture: Any
) -> None:
    sheet, eye = numbered_sheet(layout), Eye(21.3, -17.9, 140.0)
    window = Window(37, 41, wide_mm=7.9, high_mm=7.3, right_mm=0.4, up_mm=-0.6)
    seen = observe(sheet, display_of(layout, gap_mm=gap_mm, aperture=aperture), eye, rays=1, window=window)
    high, wide = layout.pixel_mm(1.0)
    middle = np.array([layout.cols * wide, layout.rows * high]) / 2
    centres = (lens_centres(layout) - middle).reshape(-1, 2)
    for row, down in enumerate(window.down_mm):
        for col, right in enumerate(window.across_mm):
            point = np.array([right, down])
            lens = centres[np.linalg.norm(centres - point, axis=1).argmin()]
            bends = aperture == "full" or np.linalg.norm(point - lens) <= 0.5
            slope = (point - np.array([eye.x_mm, -eye.y_mm])) / eye.distance_mm - bends * (point - lens) / F_MM
            x, y = point + gap_mm * slope + middle
            np.testing.assert_array_equal(seen[row, col], sheet[int(y // high), int(x // wide)])


@given(layout=LAYOUTS, x=st.floats(-20, 20), y=st.floats(-20, 20), distance=st.floats(100, 900))
def test_the_middle_of_a_lens_shows_the_pixel_nearest_to_the_place_that_perspective_interpolates(
    layout: CellLayout, x: float, y: float, distance: float
) -> None:
    sheet, eye = numbered_sheet(layout), Eye(x, y, distance)
    seen = by_lens(observe(sheet, display_of(layout), eye, rays=1, window=at_lenses(layout)), layout)
    right, down = places_px(layout, eye, pitch_mm=1.0, gap_mm=F_MM)
    row, col = down + layout.cell_rows / 2, right + layout.cell_cols / 2
    clear = np.minimum(np.abs(row - row.round()), np.abs(col - col.round())) > 1e-5  # else either of two pixels
    inside = perspective(image_of(sheet, layout, pitch_mm=1.0, focal_length_mm=F_MM), eye).seen & clear
    lens = np.argwhere(inside)
    in_cell = (np.floor(row[inside]).astype(int), np.floor(col[inside]).astype(int))
    own = layout.mask[in_cell]  # at a slanted side the nearest pixel may be the neighbour's
    nearest = cells(sheet, layout)[lens[own, 0], lens[own, 1], in_cell[0][own], in_cell[1][own]]
    np.testing.assert_array_equal(seen[lens[own, 0], lens[own, 1]], nearest)


def test_it_differs_from_perspective_by_half_a_pixel_at_most() -> None:
    ramp = np.add.outer(np.arange(6.0), np.arange(6.0))[np.newaxis, np.newaxis, :, :, np.newaxis]
    sheet = sheet_of(np.broadcast_to(ramp, (11, 13, 6, 6, 1)).copy(), SQUARE)
    for eye in (Eye(0, 0, 300), Eye(20.1, -13.4, 300), Eye(-35.7, 35.0, 500)):
        pinholes = perspective(image_of(sheet, SQUARE, pitch_mm=1.0, focal_length_mm=F_MM), eye)
        assert pinholes.seen.all()
        seen = observe(sheet, display_of(SQUARE), eye, rays=1, window=at_lenses(SQUARE))
        assert np.abs(seen - pinholes.picture).max() <= 0.5 + 0.5 + 1e-6  # a step down and a step across


@BOTH
def test_a_mirrored_display_is_seen_mirrored(layout: CellLayout) -> None:
    sheet, eye = numbered_sheet(layout), Eye(17.3, -8.1, 211.0)
    shifted = layout.lattice == "hexagonal"
    other = replace(layout, first_row_shifted=not layout.first_row_shifted) if shifted else layout
    how: dict[str, Any] = {"rays": 1}
    seen = observe(sheet, display_of(layout), eye, **how)
    mirrored = observe(sheet[:, ::-1], display_of(other), Eye(-17.3, -8.1, 211.0), **how)
    np.testing.assert_allclose(mirrored[:, ::-1], seen, rtol=1e-5)
    if not shifted:
        upside_down = observe(sheet[::-1], display_of(layout), Eye(17.3, 8.1, 211.0), **how)
        np.testing.assert_allclose(upside_down[::-1], seen, rtol=1e-5)


@pytest.mark.parametrize("gap_mm", [2.2, F_MM, 3.7])
@pytest.mark.parametrize("x_mm", [0.0, 40.3, 70.0, 151.0, -260.0])
def test_beyond_the_viewing_zone_a_lens_shows_its_neighbours_cell(x_mm: float, gap_mm: float) -> None:
    number = np.arange(13.0)
    sheet = np.broadcast_to(number.repeat(6)[np.newaxis, :, np.newaxis], (66, 78, 1)) + 1
    eye = Eye(x_mm, 0.0, 500.0)
    seen = observe(sheet, display_of(SQUARE, gap_mm=gap_mm), eye, rays=1, window=at_lenses(SQUARE))[5, :, 0] - 1
    zone_mm = viewing_zone_mm(pitch_mm=1.0, gap_mm=gap_mm, distance_mm=500.0)
    cells_left = np.round((x_mm - (number - 6)) / zone_mm)
    expected = np.where((number - cells_left >= 0) & (number - cells_left < 13), number - cells_left, -1)
    np.testing.assert_array_equal(seen, expected)
    assert own_share(display_of(SQUARE, gap_mm=gap_mm), eye) == pytest.approx((cells_left == 0).mean())


def test_from_one_zone_to_the_next_the_picture_comes_again_by_a_lens() -> None:
    layout, far_mm = CellLayout(5, 9, 8), 1e7
    sheet, zone_mm = numbered_sheet(layout), viewing_zone_mm(pitch_mm=1.0, gap_mm=F_MM, distance_mm=1e7)
    here, there = (
        observe(sheet, display_of(layout), Eye(x, 0.1 * far_mm, far_mm), rays=1, window=at_lenses(layout))
        for x in (0.13 * zone_mm, 1.13 * zone_mm)
    )
    np.testing.assert_array_equal(there[:, 1:], here[:, :-1])


def test_a_devices_pixels_in_place_of_the_sheets_own_change_nothing() -> None:
    sheet = numbered_sheet(SQUARE)
    on_device = to_device(sheet, SQUARE, px_per_lens_device=6.0, margin_px=4)
    eye = Eye(12.3, 4.5, 200.0)
    shown = display_of(SQUARE, device_px_mm=1 / 6)
    np.testing.assert_array_equal(
        observe(on_device, shown, eye, rays=4), observe(sheet, display_of(SQUARE), eye, rays=4)
    )


@pytest.mark.parametrize(("bare", "dark"), [("black", 1 - math.pi / 4), ("clear", 0.0)])
def test_round_lenses_leave_a_part_bare(bare: Any, dark: float) -> None:
    display = display_of(SQUARE, aperture="inscribed", bare=bare)
    window = Window(1000, 1000, wide_mm=10, high_mm=10)
    seen = observe(np.ones((66, 78, 1)), display, Eye(0, 0, 500), rays=1, window=window)
    assert (seen == 0).mean() == pytest.approx(dark, abs=1e-3)


@pytest.mark.parametrize(("surround", "light"), [("black", 0.0), ("white", 1.0)])
def test_beyond_the_sheet_is_what_surrounds_it(surround: Any, light: float) -> None:
    window = Window(8, 8, wide_mm=4, high_mm=4, right_mm=20)
    seen = observe(np.full((66, 78, 3), 0.4), display_of(SQUARE, surround=surround), Eye(0, 0, 500), window=window)
    np.testing.assert_array_equal(seen, light)


def test_more_rays_come_closer_to_what_endless_rays_give() -> None:
    sheet = np.random.default_rng(5).random((66, 78, 1))
    display, eye, window = display_of(SQUARE), Eye(4.1, 3.2, 300.0), window_of(wide_mm=13, high_mm=11, size_px=26)
    best = observe(sheet, display, eye, rays=16384, window=window)
    errors = [
        np.sqrt(((observe(sheet, display, eye, rays=rays, window=window) - best) ** 2).mean())
        for rays in (1, 16, 64, 256, 1024)
    ]
    for few, many in pairwise(errors):
        assert many < 0.7 * few
    assert errors[2] < 0.02


@given(count=st.integers(1, 500))
def test_rays_fill_the_pupil_and_the_pixel_evenly(count: int) -> None:
    spread = eye_rays(count)
    assert len(spread.pupil) == len(spread.pixel) == count
    assert (np.hypot(*spread.pupil.T) <= 1).all()
    assert (np.abs(spread.pixel) <= 0.5).all()
    if count >= 64:
        np.testing.assert_allclose(spread.pupil.mean(axis=0), 0, atol=0.01)
        np.testing.assert_allclose(spread.pixel.mean(axis=0), 0, atol=0.03)
        np.testing.assert_allclose((spread.pupil**2).mean(axis=0), 1 / 4, atol=0.01)
        np.testing.assert_allclose((spread.pixel**2).mean(axis=0), 1 / 12, atol=0.01)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"gap_mm": 0.0}, "expected a positive gap in mm, got 0"),
        ({"gap_mm": math.inf}, "expected a positive gap in mm, got inf"),
        ({"pitch_mm": -1.0}, "expected a positive pitch in mm, got -1"),
        ({"device_px_mm": 0.0}, "expected a positive pixel in mm, got 0"),
    ],
    ids=str,
)
def test_a_display_that_cannot_be_built_is_refused(change: dict[str, Any], said: str) -> None:
    with pytest.raises(LayoutError, match=said):
        display_of(SQUARE, **change)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"pupil_mm": 0.0}, "expected a pupil of a positive diameter in mm, got 0"),
        ({"pupil_mm": math.nan}, "expected a pupil of a positive diameter in mm, got nan"),
        ({"focus_mm": 500.0}, r"expected a focus nearer to the display than the eye, \(0, 0, 500\) mm, got 500 mm"),
        ({"focus_mm": math.nan}, "expected a focus nearer to the display than the eye"),
        ({"rays": 0}, "expected from 1 to 16384 rays a pixel, got 0"),
    ],
    ids=str,
)
def test_an_eye_that_cannot_see_is_refused(how: dict[str, Any], said: str) -> None:
    with pytest.raises(LayoutError, match=said):
        observe(numbered_sheet(SQUARE), display_of(SQUARE), Eye(0, 0, 500), **how)


def test_a_sheet_of_another_size_is_refused() -> None:
    with pytest.raises(LayoutError, match="77 x 66 px do not divide among"):
        observe(np.ones((66, 77, 3)), display_of(SQUARE), Eye(0, 0, 500))
    with pytest.raises(LayoutError, match="expected a window of at least 260 x 307 px"):
        observe(np.ones((66, 77, 3)), display_of(SQUARE, device_px_mm=25.4 / 600), Eye(0, 0, 500))


@pytest.mark.parametrize("count", [16, 64, 256, 1000, 4096])
def test_no_two_rays_cross_the_pupil_close_to_each_other(count: int) -> None:
    """The golden angle keeps every two rays 1.5 / sqrt(count) radii apart; an angle 0.001 beside it does not."""
    distances, _ = cKDTree(pupil := eye_rays(count).pupil).query(pupil, k=2)
    assert distances[:, 1].min() > 1.5 / math.sqrt(count)


@pytest.mark.parametrize("size_px", [0, -5, 8193, 10**9])
def test_a_picture_of_no_size_or_a_huge_one_is_refused(size_px: int) -> None:
    with pytest.raises(LayoutError, match="expected a picture of 1 to 8192 px a side, got"):
        whole_window(display_of(SQUARE), size_px=size_px)


def test_a_window_without_width_is_refused() -> None:
    with pytest.raises(LayoutError, match="expected a window of a positive width and height"):
        Window(8, 8, wide_mm=0.0, high_mm=1.0)
