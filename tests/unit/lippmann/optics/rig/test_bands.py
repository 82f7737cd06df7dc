"""Wavelength bands: shares that keep white white, and the lens at each wavelength."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lippmann.job.spec import parse_spec
from lippmann.optics.lens.dispersion import LINE_C_NM, LINE_D_NM, LINE_F_NM
from lippmann.optics.lens.matrices import cardinal_points
from lippmann.optics.rig.bands import lens_at, wavelength_bands
from lippmann.optics.rig.bench import Bench, bench
from lippmann.optics.rig.colour_matching import colour_matching, srgb_weights

ABBE = 30.0


def singlet(abbe: float | None, *, dispersion: bool = True) -> Bench:
    surfaces: list[dict[str, Any]] = [
        {"radius_mm": 300, "thickness_mm": 8, "index": 1.6, "abbe": abbe, "semi_aperture_mm": 40},
        {"radius_mm": -300, "index": 1, "semi_aperture_mm": 40},
    ]
    rig = {"imaging_lens": {"surfaces": surfaces}, "dispersion": dispersion, "lens_array": {"count": [6, 8]}}
    return bench(parse_spec({"scene": "fish", "rig": rig}).rig, reference_mm=1000.0)


@pytest.mark.parametrize("count", [2, 3, 7, 32])
def test_the_shares_of_a_channel_sum_to_one_and_none_is_negative(count: int) -> None:
    weights = np.array([band.weights for band in wavelength_bands(singlet(ABBE), count)])
    assert weights.shape == (count, 3)
    assert weights.sum(axis=0) == pytest.approx(1.0, abs=1e-12)
    assert (weights >= 0).all()


def test_the_matching_functions_are_those_of_the_cie() -> None:
    """CIE 1931 2-degree observer, CIE 015:2004, Table T.4; the fit of the paper is near it, not equal."""
    wavelengths_nm = np.array([450.0, 500.0, 550.0, 600.0, 650.0])
    table = [
        [0.3362, 0.0380, 1.77211],
        [0.0049, 0.3230, 0.2720],
        [0.43345, 0.99495, 0.00875],
        [1.0622, 0.6310, 0.0008],
        [0.2835, 0.1070, 0.0],
    ]
    assert colour_matching(wavelengths_nm) == pytest.approx(np.array(table), abs=0.03)


def test_each_channel_has_its_own_part_of_the_spectrum() -> None:
    edges_nm = np.linspace(380, 730, 33)
    red_nm, green_nm, blue_nm = (edges_nm[:-1] + edges_nm[1:]) / 2 @ srgb_weights(edges_nm)
    assert 440 < blue_nm < 470 < 530 < green_nm < 560 < 580 < red_nm < 620


def test_coarse_bands_are_sums_of_fine_ones() -> None:
    fine, coarse = srgb_weights(np.linspace(380, 730, 29)), srgb_weights(np.linspace(380, 730, 8))
    assert fine.reshape(7, 4, 3).sum(axis=1) == pytest.approx(coarse, abs=1e-4)


@pytest.mark.parametrize("asked", [singlet(None), singlet(ABBE, dispersion=False)], ids=["no Abbe number", "off"])
def test_without_dispersion_one_band_has_the_bench_itself(asked: Bench) -> None:
    (band,) = wavelength_bands(asked, 7)
    assert band.bench is asked
    assert band.weights == (1.0, 1.0, 1.0)


def test_a_lens_has_its_abbe_number_and_its_longitudinal_colour() -> None:
    """The power of a thin lens goes with n - 1, so its focal lengths at F and C differ by f / V."""
    lens = singlet(ABBE).imaging_lens
    assert lens is not None
    blue, yellow, red = (lens_at(lens, nm) for nm in (LINE_F_NM, LINE_D_NM, LINE_C_NM))
    assert yellow == lens
    indices = [one.surfaces[0].index_after for one in (blue, yellow, red)]
    assert (indices[1] - 1) / (indices[0] - indices[2]) == pytest.approx(ABBE, rel=1e-9)
    assert [one.surfaces[1].index_after for one in (blue, yellow, red)] == [1.0] * 3
    focal_mm = [cardinal_points(one).effective_focal_length_mm for one in (blue, yellow, red)]
    assert focal_mm[2] - focal_mm[0] == pytest.approx(focal_mm[1] / ABBE, rel=0.01)
