"""What an eye sees of a point of the display proves where it stands: two eyes, a moving eye, the focus of an eye."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.observer.display import LensDisplay
from lippmann.lightfield.observer.observe import observe, whole_window
from lippmann.lightfield.observer.window import Window, window_of
from lippmann.lightfield.sheet.device import to_device
from lippmann.lightfield.views.perspective import Eye
from lippmann.optics.rig.display import central_depth_plane_mm
from tests.unit.lippmann.lightfield.displays import F_MM, GAP_REAL_MM, GAP_VIRTUAL_MM, centroid_mm, display_of
from tests.unit.lippmann.lightfield.textures import sheet_of_texture, spot

SQUARE = CellLayout(25, 25, 24)
HEXAGONAL = CellLayout(28, 25, 24, lattice="hexagonal")
EYES_MM, DISTANCE_MM = 63.0, 500.0
DEVICE_PX_MM = 25.4 / 600


def seen_at(display: LensDisplay, sheet: NDArray[np.float32], x_mm: float, y_mm: float = 0.0) -> tuple[float, float]:
    """Return where on the array an eye sees the point, mm (right, up)."""
    window = whole_window(display, size_px=200)
    return centroid_mm(observe(sheet, display, Eye(x_mm, y_mm, DISTANCE_MM), window=window), window)


def shown(
    layout: CellLayout, depth_mm: float, *, gap_mm: float = F_MM, device: bool = False
) -> tuple[LensDisplay, NDArray[np.float32]]:
    """Return a display, and its sheet of a point at a depth by plain geometry, for a gap of one focal length."""
    sheet = sheet_of_texture(layout, spot, depth_mm, focal_mm=F_MM)
    if device:
        sheet = to_device(sheet, layout, px_per_lens_device=1 / DEVICE_PX_MM)
    return display_of(layout, gap_mm=gap_mm, device_px_mm=DEVICE_PX_MM if device else None), sheet


@pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL], ids=str)
@pytest.mark.parametrize("device", [False, True], ids=["own pixels", "23.6 px a lens"])
@pytest.mark.parametrize("depth_mm", [30.0, -30.0])
def test_two_eyes_see_a_point_apart_as_geometry_says(layout: CellLayout, depth_mm: float, device: bool) -> None:
    display, sheet = shown(layout, depth_mm, device=device)
    left, right = (seen_at(display, sheet, x_mm)[0] for x_mm in (-EYES_MM / 2, EYES_MM / 2))
    assert left - right == pytest.approx(EYES_MM * depth_mm / (DISTANCE_MM - depth_mm), rel=0.05)


@pytest.mark.parametrize("gap_mm", [GAP_REAL_MM, GAP_VIRTUAL_MM])
@pytest.mark.parametrize("depth_mm", [30.0, -30.0])
def test_another_gap_shows_the_point_deeper_in_proportion(depth_mm: float, gap_mm: float) -> None:
    display, sheet = shown(SQUARE, depth_mm, gap_mm=gap_mm, device=True)
    left, right = (seen_at(display, sheet, x_mm)[0] for x_mm in (-EYES_MM / 2, EYES_MM / 2))
    stands_mm = depth_mm * gap_mm / F_MM
    assert left - right == pytest.approx(EYES_MM * stands_mm / (DISTANCE_MM - stands_mm), rel=0.05)


@pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL], ids=str)
@pytest.mark.parametrize("depth_mm", [30.0, -30.0])
def test_a_moving_eye_sees_real_points_go_against_it_and_virtual_ones_with_it(
    layout: CellLayout, depth_mm: float
) -> None:
    display, sheet = shown(layout, depth_mm)
    crossing = -depth_mm / (DISTANCE_MM - depth_mm)
    a_pixel_mm = abs(crossing) * max(display.pixel_mm) / F_MM * DISTANCE_MM
    for x_mm, y_mm in ((45.0, 0.0), (-45.0, 0.0), (0.0, 45.0), (35.0, -35.0)):
        moved = np.subtract(seen_at(display, sheet, x_mm, y_mm), seen_at(display, sheet, 0.0))
        assert moved == pytest.approx((x_mm * crossing, y_mm * crossing), abs=a_pixel_mm)


@pytest.mark.parametrize("depth_mm", [30.0, -30.0])
def test_coarse_pixels_show_two_eyes_a_whole_number_of_views_apart(depth_mm: float) -> None:
    """With 8 px a lens the directions are 19 mm apart where the eyes are: three or four of them between two eyes."""
    display, sheet = shown(CellLayout(25, 25, 8), depth_mm)
    step_mm = 1 / 8 / F_MM * DISTANCE_MM
    apart = []
    for middle_mm in (np.arange(8) + 0.5) / 8 * step_mm:
        left, right = (seen_at(display, sheet, middle_mm + x_mm)[0] for x_mm in (-EYES_MM / 2, EYES_MM / 2))
        apart.append(left - right)
    of_one_mm = depth_mm / (DISTANCE_MM - depth_mm)
    assert np.abs(np.array(apart) / of_one_mm - EYES_MM).max() <= step_mm
    assert np.mean(apart) == pytest.approx(EYES_MM * of_one_mm, rel=0.05)


@pytest.mark.parametrize("gap_mm", [GAP_REAL_MM, GAP_VIRTUAL_MM])
def test_pixels_are_sharpest_to_an_eye_that_focuses_on_the_central_depth_plane(gap_mm: float) -> None:
    plane_mm = central_depth_plane_mm(focal_length_mm=F_MM, gap_mm=gap_mm)
    assert plane_mm == pytest.approx(29.556 if gap_mm == GAP_REAL_MM else -6.735, abs=0.01)
    layout = CellLayout(5, 5, 24)
    noise = np.random.default_rng(3).random((119, 119, 1)).astype(np.float32)
    display = display_of(layout, gap_mm=gap_mm, device_px_mm=DEVICE_PX_MM)
    inside_a_lens = window_of(wide_mm=0.5, high_mm=0.5, size_px=60)
    depths_mm = plane_mm + np.arange(-12.0, 13.0, 3.0)
    sharp = []
    for focus_mm in depths_mm:
        seen = observe(noise, display, Eye(0, 0, 250), pupil_mm=6.0, focus_mm=focus_mm, rays=256, window=inside_a_lens)
        sharp.append((np.diff(seen, axis=0) ** 2).sum() + (np.diff(seen, axis=1) ** 2).sum())
    assert depths_mm[int(np.argmax(sharp))] == pytest.approx(plane_mm)


def test_the_wider_the_pupil_the_more_is_blurred_away_from_the_focus() -> None:
    display, sheet = shown(SQUARE, 0.0)
    window = Window(100, 100, wide_mm=10, high_mm=10)
    highest = [
        observe(sheet, display, Eye(0, 0, DISTANCE_MM), pupil_mm=pupil_mm, focus_mm=-200.0, window=window).max()
        for pupil_mm in (1.0, 4.0, 8.0)
    ]
    assert highest[0] > 1.05 * highest[1] > 1.05**2 * highest[2]
