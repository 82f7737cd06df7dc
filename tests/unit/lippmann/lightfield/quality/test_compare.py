"""PSNR and SSIM: laws, formulas, an independent SSIM window by window, and numbers of scikit-image."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.quality.compare import C1, compare, compare_views, psnr_db, spread, ssim
from lippmann.lightfield.views.views import view, view_numbers
from tests.unit.lippmann.lightfield.sheets import LAYOUTS, SQUARE_LAYOUTS, lens_numbers

Codes = NDArray[np.uint8]

SIZES = st.tuples(st.integers(1, 30), st.integers(1, 30))
SEEDS = st.integers(0, 2**32 - 1)


def noise(rows: int, cols: int, seed: int = 0) -> Codes:
    return np.random.default_rng(seed).integers(0, 256, (rows, cols, 3), dtype=np.uint8)


def ramps(rows: int = 37, cols: int = 29) -> tuple[Codes, Codes]:
    """A smooth picture, and the same after a coarse codec: nothing in it is random."""
    row, col, channel = np.mgrid[:rows, :cols, :3]
    smooth = (row * col // 5 + 40 * channel) % 256
    return smooth.astype(np.uint8), (smooth // 24 * 24).astype(np.uint8)


@given(size=SIZES, seed=SEEDS)
def test_a_picture_is_identical_to_itself(size: tuple[int, int], seed: int) -> None:
    picture = noise(*size, seed)
    alike = compare(picture, picture.copy())
    assert alike.psnr_y_db == alike.psnr_rgb_db == math.inf
    assert math.isnan(alike.ssim) if min(size) < 11 else alike.ssim == pytest.approx(1, abs=1e-12)


@given(size=SIZES, seeds=st.tuples(SEEDS, SEEDS))
def test_it_does_not_matter_which_comes_first(size: tuple[int, int], seeds: tuple[int, int]) -> None:
    first, second = (noise(*size, seed) for seed in seeds)
    there, back = compare(first, second), compare(second, first)
    assert (there.psnr_y_db, there.psnr_rgb_db) == (back.psnr_y_db, back.psnr_rgb_db)
    np.testing.assert_allclose(there.ssim, back.ssim, rtol=1e-12)


@given(size=st.tuples(st.integers(11, 30), st.integers(11, 30)), seeds=st.tuples(SEEDS, SEEDS))
def test_ssim_lies_between_minus_one_and_one(size: tuple[int, int], seeds: tuple[int, int]) -> None:
    first, second = (noise(*size, seed) for seed in seeds)
    assert -1 <= ssim(first, second) <= 1
    assert ssim(first, np.uint8(255) - first) < 0


@given(shift=st.integers(1, 100), size=SIZES)
def test_a_known_squared_error_is_a_known_psnr(shift: int, size: tuple[int, int]) -> None:
    dark = np.full((*size, 3), 100, dtype=np.uint8)
    alike = compare(dark, dark + np.uint8(shift))
    assert alike.psnr_y_db == pytest.approx(20 * math.log10(255 / shift))
    assert alike.psnr_rgb_db == pytest.approx(20 * math.log10(255 / shift))


def test_luma_weighs_the_channels_as_bt_709_and_rgb_weighs_them_alike() -> None:
    dark = np.zeros((4, 6, 3), dtype=np.uint8)
    for channel, weight in enumerate((0.2126, 0.7152, 0.0722)):
        lit = dark.copy()
        lit[..., channel] = 10
        alike = compare(dark, lit)
        assert alike.psnr_y_db == pytest.approx(psnr_db((10 * weight) ** 2))
        assert alike.psnr_rgb_db == pytest.approx(psnr_db(100 / 3))


def test_black_against_white_has_no_signal_left() -> None:
    alike = compare(np.zeros((12, 12, 3), dtype=np.uint8), np.full((12, 12, 3), 255, dtype=np.uint8))
    assert alike.psnr_y_db == pytest.approx(0)
    assert alike.ssim == pytest.approx(C1 / (255**2 + C1))


@given(level=st.integers(0, 200), shift=st.integers(0, 55))
def test_ssim_of_two_flat_pictures_is_the_luminance_term(level: int, shift: int) -> None:
    flat = np.full((13, 17, 3), level, dtype=np.uint8)
    other = level + shift
    expected = (2 * level * other + C1) / (level**2 + other**2 + C1)
    assert ssim(flat, flat + np.uint8(shift)) == pytest.approx(expected, abs=1e-9)


def windowed_ssim(first: Codes, second: Codes) -> float:
    """Wang et al. 2004, eqs. (6), (9), (10) and (14) to (17), window by window."""
    luma = [picture @ np.array([0.2126, 0.7152, 0.0722]) for picture in (first, second)]
    row, col = np.mgrid[-5:6, -5:6]
    weights = np.exp(-(row**2 + col**2) / (2 * 1.5**2))
    weights /= weights.sum()
    found = []
    for top, left in np.ndindex(first.shape[0] - 10, first.shape[1] - 10):
        x, y = (one[top : top + 11, left : left + 11] for one in luma)
        mean_x, mean_y = (weights * x).sum(), (weights * y).sum()
        var_x, var_y = (weights * (x - mean_x) ** 2).sum(), (weights * (y - mean_y) ** 2).sum()
        covariance = (weights * (x - mean_x) * (y - mean_y)).sum()
        c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
        c3, spread_x, spread_y = c2 / 2, math.sqrt(var_x), math.sqrt(var_y)
        luminance = (2 * mean_x * mean_y + c1) / (mean_x**2 + mean_y**2 + c1)
        contrast = (2 * spread_x * spread_y + c2) / (var_x + var_y + c2)
        found.append(luminance * contrast * (covariance + c3) / (spread_x * spread_y + c3))
    return float(np.mean(found))


@settings(max_examples=10)
@given(size=st.tuples(st.integers(11, 20), st.integers(11, 20)), seeds=st.tuples(SEEDS, SEEDS))
def test_ssim_is_that_of_the_paper_window_by_window(size: tuple[int, int], seeds: tuple[int, int]) -> None:
    first, second = (noise(*size, seed) for seed in seeds)
    half = ((first.astype(int) + second) // 2).astype(np.uint8)
    assert ssim(first, half) == pytest.approx(windowed_ssim(first, half), abs=1e-9)


def test_numbers_are_those_of_scikit_image() -> None:
    # scikit-image 0.26: peak_signal_noise_ratio, and structural_similarity(gaussian_weights=True, sigma=1.5,
    # use_sample_covariance=False, data_range=255) of the unrounded luma.
    alike = compare(*ramps())
    assert alike.psnr_y_db == pytest.approx(26.30919857221397, abs=1e-9)
    assert alike.psnr_rgb_db == pytest.approx(25.795788071018542, abs=1e-9)
    assert alike.ssim == pytest.approx(0.8797426312263436, abs=1e-9)


@pytest.mark.parametrize("rows", [74, 75, 128, 139])
def test_strips_leave_no_seam(rows: int) -> None:
    first, second = ramps(rows, 12)
    assert ssim(first, second) == pytest.approx(windowed_ssim(first, second), abs=1e-9)


@given(layout=LAYOUTS, seeds=st.tuples(SEEDS, SEEDS))
def test_a_view_is_compared_as_the_picture_that_it_is(layout: CellLayout, seeds: tuple[int, int]) -> None:
    first, second = (noise(layout.rows, layout.cols, seed) for seed in seeds)
    every = compare_views(first, second, layout)
    for u, v in view_numbers(layout):
        one = compare(view(first, layout, u, v), view(second, layout, u, v))
        assert every.psnr_y_db[v, u] == one.psnr_y_db
        assert every.psnr_rgb_db[v, u] == one.psnr_rgb_db
        np.testing.assert_array_equal(every.ssim[v, u], one.ssim)


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_views_large_enough_have_an_ssim(lattice: str) -> None:
    layout = CellLayout(12, 13, 4, "hexagonal" if lattice == "hexagonal" else "square")
    first, second = noise(layout.rows, layout.cols, 1), noise(layout.rows, layout.cols, 2)
    every = compare_views(first, second, layout)
    u, v = view_numbers(layout)[3]
    assert every.ssim[v, u] == ssim(view(first, layout, u, v), view(second, layout, u, v))
    np.testing.assert_array_equal(np.isnan(every.ssim), ~layout.mask)


@given(layout=LAYOUTS, seed=SEEDS)
def test_where_no_view_is_there_is_no_number_and_pixels_under_no_lens_do_not_count(
    layout: CellLayout, seed: int
) -> None:
    first = noise(layout.rows, layout.cols, seed)
    second = first.copy()
    second[lens_numbers(layout) < 0] ^= 255
    every = compare_views(first, second, layout)
    np.testing.assert_array_equal(np.isnan(every.psnr_y_db), ~layout.mask)
    assert spread(every.psnr_rgb_db).infinite == len(view_numbers(layout))


@given(layout=SQUARE_LAYOUTS, seeds=st.tuples(SEEDS, SEEDS))
def test_the_squared_error_of_a_square_sheet_is_the_mean_over_its_views(
    layout: CellLayout, seeds: tuple[int, int]
) -> None:
    first, second = (noise(layout.rows, layout.cols, seed) for seed in seeds)
    every = compare_views(first, second, layout).psnr_rgb_db
    pooled = float(np.mean(255**2 / 10 ** (every / 10)))
    assert compare(first, second).psnr_rgb_db == pytest.approx(psnr_db(pooled))


def test_the_worst_view_is_the_one_that_was_damaged() -> None:
    layout = CellLayout(3, 4, 5)
    first = noise(layout.rows, layout.cols)
    second = first.copy()
    second[..., 0] ^= 1
    view(second, layout, 3, 1)[:] ^= 8
    over = spread(compare_views(first, second, layout).psnr_rgb_db)
    assert over.worst == (3, 1)
    assert over.minimum == compare(view(first, layout, 3, 1), view(second, layout, 3, 1)).psnr_rgb_db
    assert over.infinite == 0


def test_identical_views_do_not_hide_the_others() -> None:
    over = spread(np.array([[math.inf, 30.0], [math.nan, 34.0]]))
    assert (over.mean, over.minimum, over.deviation, over.worst, over.infinite) == (32.0, 30.0, 2.0, (1, 0), 1)
    alike = spread(np.array([[math.inf, math.nan]]))
    assert (alike.mean, alike.minimum, alike.deviation, alike.worst) == (math.inf, math.inf, 0.0, None)
    assert spread(np.array([[1.0, 1.0]])).worst is None
    none = spread(np.array([[math.nan]]))
    assert math.isnan(none.mean)
    assert none.worst is None


@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        (noise(4, 5), noise(4, 6), "same size twice, got 5 x 4 px and 6 x 4 px"),
        (noise(4, 5), noise(4, 5).astype(np.float32), "8-bit codes .*, got float32"),
        (noise(4, 5), noise(4, 5)[..., :2], r"got uint8 \(4, 5, 2\)"),
        (noise(0, 5), noise(0, 5), r"got uint8 \(0, 5, 3\)"),
    ],
    ids=["sizes", "light", "channels", "empty"],
)
def test_what_cannot_be_compared_is_refused(first: Codes, second: Codes, said: str) -> None:
    with pytest.raises(LayoutError, match=said):
        compare(first, second)


def test_sheets_of_other_lenses_are_refused() -> None:
    with pytest.raises(LayoutError, match="12 x 20 px do not divide among 5 x 4 lenses of 4 px"):
        compare_views(noise(20, 12), noise(20, 12), CellLayout(4, 5, 4))
