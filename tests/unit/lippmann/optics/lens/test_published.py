"""The published lenses do what their sources say."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lippmann.job.optics.glasses import glasses_by_maker
from lippmann.optics.lens.dispersion import LINE_C_NM, LINE_D_NM, LINE_F_NM, povray_dispersion, povray_index
from lippmann.optics.lens.matrices import cardinal_points, matrix_to
from lippmann.optics.lens.published import COOKE_TRIPLET, IMAGING_LENSES, TRONNIER_1954
from lippmann.optics.lens.stop import f_number, stop_place_mm
from lippmann.optics.lens.surfaces import ImagingLens, Stop
from lippmann.optics.lens.trace import Rays, through_lens, unit

# Sellmeier coefficients of Schott's data sheets (N-SK16, F2): index at a wavelength.
SELLMEIER = {
    1.62041: ((1.34317774, 0.241144399, 0.994317969), (0.00704687339, 0.0229005004, 92.7508526)),
    1.62004: ((1.34533359, 0.209073176, 0.937357162), (0.00997743871, 0.0470450767, 111.886764)),
}


def at_550_nm(lens: ImagingLens) -> ImagingLens:
    def index(nd: float) -> float:
        if nd == 1.0:
            return 1.0
        square = 0.55**2
        return math.sqrt(1 + sum(b * square / (square - c) for b, c in zip(*SELLMEIER[nd], strict=True)))

    return replace(
        lens, surfaces=tuple(replace(surface, index_after=index(surface.index_after)) for surface in lens.surfaces)
    )


def hexapolar(rings: int) -> np.ndarray:
    """Return points of a unit circle as design programs sample it: the centre, and rings of 6, 12, 18, ..."""
    turns = [np.exp(2j * math.pi * np.arange(6 * ring) / (6 * ring)) * ring / rings for ring in range(1, rings + 1)]
    points = np.concatenate([[0j], *turns])
    return np.stack([points.real, points.imag], axis=-1)


def spot_rms_mm(
    lens: ImagingLens, *, field_deg: float, pupil_mm: float, plane_mm: float, stopped: bool = True
) -> float:
    """Return the RMS radius around the centroid, of parallel light through the paraxial entrance pupil."""
    stop_z_mm = lens.stop.z_mm if lens.stop else stop_place_mm(lens)
    (a, b), _ = matrix_to(lens, stop_z_mm)
    slope = math.tan(math.radians(field_deg))
    x, y = np.moveaxis(hexapolar(6) * pupil_mm / 2, -1, 0)
    start = np.stack([x, y - slope * b / a, np.zeros_like(x)], axis=-1)
    direction = unit(np.array([0.0, slope, 1.0]))
    start = start - 30 * direction
    after = through_lens(Rays(start, np.broadcast_to(direction, start.shape)), lens, stopped=stopped)
    points = after.at_z(lens.length_mm + plane_mm)[:, :2]
    points = points[~np.isnan(points[:, 0])]
    assert len(points) > 0.05 * len(x)
    return float(np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=-1))))


def test_the_triplet_has_the_published_focal_length_pupil_and_spots() -> None:
    """Against figures published with the design by other programs: at 550 nm, f 49.99978 mm, entrance pupil 10 mm."""
    lens = at_550_nm(COOKE_TRIPLET)
    assert cardinal_points(lens).effective_focal_length_mm == pytest.approx(49.999783, abs=3e-4)
    rear_of_flint_mm = 10.266482
    (a, b), _ = matrix_to(lens, rear_of_flint_mm - 1e-9)
    assert b / a == pytest.approx(11.512159, abs=1e-3)
    for field_deg, published_mm in ((0.0, 0.00429369), (14.0, 0.01691841), (20.0, 0.01211669)):
        placed = replace(lens, stop_z_mm=rear_of_flint_mm - 1e-9)
        found = spot_rms_mm(placed, field_deg=field_deg, pupil_mm=10.0, plane_mm=42.20778, stopped=False)
        assert found == pytest.approx(published_mm, rel=0.01)


def test_the_double_gauss_has_the_focal_lengths_printed_in_its_patent() -> None:
    """f = 1 and a back focus of 0.71436 f, from the patent's table to its last digits."""
    points = cardinal_points(TRONNIER_1954)
    assert points.effective_focal_length_mm == pytest.approx(50.0, rel=2e-4)
    assert points.back_focal_distance_mm / points.effective_focal_length_mm == pytest.approx(0.71436, rel=5e-5)
    assert f_number(TRONNIER_1954) == pytest.approx(2.0, rel=0.04)


@pytest.mark.parametrize(("field_deg", "largest_um"), [(0.0, 30.0), (10.0, 30.0), (18.0, 45.0)])
def test_the_double_gauss_is_well_corrected_at_its_best_focus(field_deg: float, largest_um: float) -> None:
    lens = TRONNIER_1954
    back_mm = cardinal_points(lens).back_focal_distance_mm
    spots = [
        spot_rms_mm(lens, field_deg=field_deg, pupil_mm=50 / 2.8, plane_mm=back_mm + shift)
        for shift in np.linspace(-0.3, 0.1, 21)
    ]
    assert min(spots) * 1000 < largest_um


def test_well_corrected_lenses_beat_the_papers() -> None:
    """Blur by blur of the same angle: RMS spot over focal length, on the axis at f/5."""
    blur = {}
    for name, lens in IMAGING_LENSES.items():
        points = cardinal_points(lens)
        focal_mm = points.effective_focal_length_mm
        planes = points.back_focal_distance_mm + np.linspace(-0.02, 0.005, 26) * focal_mm
        blur[name] = min(
            spot_rms_mm(lens, field_deg=0.0, pupil_mm=focal_mm / 5, plane_mm=float(plane)) / focal_mm
            for plane in planes
        )
    assert 2 * max(blur["double-gauss-tronnier"], blur["cooke-triplet"]) < blur["athineos-2006"]


def test_stopping_down_sharpens() -> None:
    back_mm = cardinal_points(TRONNIER_1954).back_focal_distance_mm
    place_mm = stop_place_mm(TRONNIER_1954)
    sharp = replace(TRONNIER_1954, stop=Stop(place_mm, 2.0))
    wide_um, narrow_um = (
        1000 * spot_rms_mm(lens, field_deg=10.0, pupil_mm=24.0, plane_mm=back_mm - 0.1)
        for lens in (TRONNIER_1954, sharp)
    )
    assert narrow_um < wide_um / 2


@pytest.mark.parametrize("maker", glasses_by_maker())
def test_povrays_dispersion_gives_every_glass_its_abbe_number(maker: str) -> None:
    for found in glasses_by_maker()[maker].values():
        check_dispersion(found.index, found.abbe)


def check_dispersion(index: float, abbe: float | None) -> None:
    dispersion = povray_dispersion(index, abbe)
    blue, yellow, red = (povray_index(index, dispersion, line) for line in (LINE_F_NM, LINE_D_NM, LINE_C_NM))
    assert yellow == index
    assert (yellow - 1) / (blue - red) == pytest.approx(abbe, rel=1e-9)


def test_glass_without_abbe_number_and_air_do_not_disperse() -> None:
    assert povray_dispersion(1.5, None) == povray_dispersion(1.0, 60.0) == 1.0


def test_catalogued_indices_are_those_of_the_data_sheets_formula() -> None:
    """By the Sellmeier formula at the d line, for the two whose coefficients stand above."""
    square = (LINE_D_NM / 1000) ** 2
    for nd, (b, c) in SELLMEIER.items():
        found = math.sqrt(1 + sum(one * square / (square - two) for one, two in zip(b, c, strict=True)))
        assert found == pytest.approx(nd, abs=6e-6)
