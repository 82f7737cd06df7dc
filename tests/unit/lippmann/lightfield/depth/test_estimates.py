"""Depth estimated from the pictures of flat textures at known depths, on both lattices, and what is said of errors."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.cell import Lattice
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.depth.depth_map import DepthMap
from lippmann.lightfield.depth.errors import depth_errors
from lippmann.lightfield.depth.plane_sweep import plane_sweep, sweep_depths
from lippmann.lightfield.depth.view_depth import Method, estimated_depth, true_depth
from lippmann.lightfield.views.square_pixels import as_square, nearest_as_square
from lippmann.lightfield.views.views import centre, view
from tests.unit.lippmann.lightfield.sheets import image_of
from tests.unit.lippmann.lightfield.textures import sheet_of_texture

FOCAL_MM = 3.3
STEP_MM = 3.3
"""Between two depths of a sweep: a quarter of a pitch in the second view from the middle, 8 px a lens."""


def waves(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return light that is nowhere flat and has no wave shorter than three lenses."""
    noise = np.random.default_rng(3)
    light = np.full(x.shape, 0.5)
    for _ in range(40):
        along, down, phase = noise.uniform(-2, 2), noise.uniform(-2, 2), noise.uniform(0, 2 * np.pi)
        light += 0.05 * np.sin(along * x + down * y + phase)
    return light


def seen_at(depth_mm: float, lattice: Lattice) -> tuple[NDArray[np.float32], CellLayout]:
    layout = CellLayout(20, 20, 8, lattice)
    return sheet_of_texture(layout, waves, depth_mm, focal_mm=FOCAL_MM), layout


@pytest.mark.parametrize("method", ["tensor", "sweep"])
@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
@pytest.mark.parametrize("depth_mm", [30.0, -30.0, 0.0, 11.3])
def test_a_plane_is_found_within_a_third_of_a_depth_step(depth_mm: float, lattice: Lattice, method: Method) -> None:
    sheet, layout = seen_at(depth_mm, lattice)
    found = estimated_depth(image_of(sheet, layout, focal_length_mm=FOCAL_MM), centre(layout), method=method)
    inner = found.s_mm[4:-4, 4:-4]
    assert np.median(inner) == pytest.approx(depth_mm, abs=0.3)
    assert (np.abs(inner - depth_mm) < STEP_MM / 3).mean() > 0.9
    assert found.disparity == pytest.approx(found.s_mm / (8 * FOCAL_MM))
    assert np.median(found.other) > 0.8, "confidence"


@pytest.mark.parametrize("method", ["tensor", "sweep"])
def test_any_view_has_its_depth(method: Method) -> None:
    sheet, layout = seen_at(20.0, "square")
    found = estimated_depth(
        image_of(sheet, layout, focal_length_mm=FOCAL_MM), (2, 5), method=method, range_mm=(0.0, 40.0)
    )
    assert np.median(found.s_mm[4:-4, 4:-4]) == pytest.approx(20.0, abs=0.5)


def test_one_thing_before_another_is_told_by_its_edge() -> None:
    """A plane at +25 mm over the left half of the display, before one at -15 mm: as rays meet them."""
    layout = CellLayout(24, 24, 8)
    near, far = (sheet_of_texture(layout, waves, depth_mm, focal_mm=FOCAL_MM) for depth_mm in (25.0, -15.0))
    covered = sheet_of_texture(layout, lambda x, _: (x < 0).astype(float), 25.0, focal_mm=FOCAL_MM)
    sheet = np.where(covered > 0.5, near, 1 - far)
    for method in ("tensor", "sweep"):
        s_mm = estimated_depth(image_of(sheet, layout, focal_length_mm=FOCAL_MM), centre(layout), method=method).s_mm[
            4:-4
        ]
        assert np.median(s_mm[:, 4:10]) == pytest.approx(25.0, abs=1.5)
        assert np.median(s_mm[:, 14:-4]) == pytest.approx(-15.0, abs=1.5)


def test_a_sweep_is_sure_of_what_half_of_the_views_do_not_see() -> None:
    """Beside the edge of a near plane, half of the views see the near plane in place of the far one behind it."""
    layout = CellLayout(24, 24, 8)
    near, far = (sheet_of_texture(layout, waves, depth_mm, focal_mm=FOCAL_MM) for depth_mm in (40.0, -30.0))
    covered = sheet_of_texture(layout, lambda x, _: (x < 0).astype(float), 40.0, focal_mm=FOCAL_MM)
    sheet = np.where(covered > 0.5, near, 1 - far)
    depths_mm = sweep_depths(layout, 60, -60, focal_mm=FOCAL_MM)
    found = plane_sweep(image_of(sheet, layout, focal_length_mm=FOCAL_MM), centre(layout), depths_mm)
    beside = slice(12, 17)
    assert np.abs(found.s_mm[4:-4, beside] + 30).max() < 1
    # The mean of all views, in place of the better half, gives about 0.5 there.
    assert np.median(found.confidence[4:-4, beside], axis=0).min() > 0.85


def test_a_flat_colour_tells_no_depth() -> None:
    layout = CellLayout(12, 12, 8)
    sheet = np.full((96, 96, 3), 0.5, dtype=np.float32)
    for method in ("tensor", "sweep"):
        found = estimated_depth(image_of(sheet, layout, focal_length_mm=FOCAL_MM), centre(layout), method=method)
        assert found.other.max() < 1e-3
        assert np.isnan(found.s_mm).all()
        assert np.isnan(found.disparity).all()


def test_what_cannot_be_estimated_is_refused() -> None:
    sheet, layout = seen_at(0.0, "square")
    with pytest.raises(LayoutError, match="expected at least three depths"):
        plane_sweep(image_of(sheet, layout, focal_length_mm=FOCAL_MM), (4, 4), [0.0, 1.0])
    with pytest.raises(LayoutError, match=r"expected a view .*\(9, 4\)|view"):
        plane_sweep(image_of(sheet, layout, focal_length_mm=FOCAL_MM), (9, 4), [0.0, 1.0, 2.0])
    single = CellLayout(8, 8, 1)
    for method in ("tensor", "sweep"):
        with pytest.raises(LayoutError, match="expected views"):
            estimated_depth(
                image_of(np.ones((8, 8, 3), np.float32), single, focal_length_mm=FOCAL_MM), (0, 0), method=method
            )


def test_errors_are_counted_as_the_benchmark_does() -> None:
    truth = np.zeros((6, 8), dtype=np.float32)
    truth[2, 2] = np.nan
    found = np.zeros_like(truth)
    found[0] = 9.0  # on the border
    found[2, 3], found[2, 4], found[3, 3], found[3, 4] = 0.02, 0.05, -0.5, np.nan
    errors = depth_errors(found, truth, border_px=1)
    assert errors.pixels == 4 * 6 - 1
    assert errors.badpix_percent == {
        0.07: pytest.approx(200 / 23),
        0.03: pytest.approx(300 / 23),
        0.01: pytest.approx(400 / 23),
    }
    # The pixel without a value is bad, and has no square.
    assert errors.mse_x100 == pytest.approx(100 * (0.02**2 + 0.05**2 + 0.5**2) / 22)
    assert errors.q25_x100 == 0
    assert errors.pixels_percent == pytest.approx(100 * 23 / 48)
    with pytest.raises(LayoutError, match="further than 3 px from the edge"):
        depth_errors(found, truth, border_px=3)


@pytest.mark.parametrize("first_row_shifted", [False, True])
def test_numbers_of_hexagonal_lenses_come_from_lenses_that_stand_near(first_row_shifted: bool) -> None:
    layout = CellLayout(9, 8, 4, "hexagonal", first_row_shifted=first_row_shifted)
    sheet = np.broadcast_to(np.mgrid[: layout.rows, : layout.cols][..., np.newaxis], (2, layout.rows, layout.cols, 1))
    for places in sheet.astype(np.float64):
        lenses = view(np.ascontiguousarray(places), layout, 1, 2)
        apart = nearest_as_square(lenses, layout) - as_square(lenses, layout)
        # Interpolated places are the pixel's own: half a row, or a quarter of a lens and what rows differ by.
        assert np.abs(apart[1:-1, 1:-1]).max() <= layout.px_per_lens * 0.51
        assert set(nearest_as_square(lenses, layout).ravel()) <= set(lenses.ravel())


def test_the_true_depth_of_a_view_is_its_shown_depth() -> None:
    layout = CellLayout(4, 4, 8)
    values = np.random.default_rng(1).random((32, 32, 4), dtype=np.float32)
    found = true_depth(DepthMap(values), layout, (1, 6), focal_mm=FOCAL_MM)
    np.testing.assert_array_equal(found.s_mm, view(values, layout, 1, 6)[..., 1])
    np.testing.assert_array_equal(found.other, view(values, layout, 1, 6)[..., 0])
    assert found.channels == ("s_mm", "disparity", "z_mm")
