"""Modelled imaging lenses against the exact trace: cemented elements, stops, thick glass, scales, dispersion."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.optics.lens.dispersion import povray_dispersion, povray_index
from lippmann.optics.lens.published import COOKE_TRIPLET, IMAGING_LENSES, TRONNIER_1954
from lippmann.optics.lens.stop import stop_place_mm
from lippmann.optics.lens.surfaces import ImagingLens, Stop, Surface
from lippmann.optics.lens.trace import Rays, through_lens
from lippmann.optics.rig.bench import bench, object_rays, pixel_centres_mm
from povtemplates.catalogue import INCLUDE_FOLDER
from tests.builders import local_place, rendered_codes, small_job, stored_job
from tests.integration.povray.conftest import Room
from worker.engines.povray.pictures.pixels import read_codes

MEDIAN_MM = 0.02
LARGEST_MM = 0.1

HALF_WIDTH_MM = 400.0
DISTANCE_MM = 1000.0

BALL = ImagingLens(
    "ball", "Thicker than its radius", "", (Surface(30.0, 60.0, 1.5, 20.0), Surface(-30.0, 0.0, 1.0, 20.0))
)
"""A ball counts from its vertex to its centre only: here each side reaches beyond the other's centre."""

TARGET = """
#include "lippmann/glass.inc"
#include "lippmann/imaging_lens.inc"
#declare Mm = {scale};
#declare Half = {half};
#declare Surfaces = array[{count}][4] {{ {rows} }};
object {{ union {{ object {{ Lippmann_Imaging_Lens(Surfaces) }} {stop} }} scale Mm }}
#macro Ramp(F, Colour)
  pigment {{ function {{ F(x, y, z) }} color_map {{ [0.25 color rgb <0, 0, 1>] [0.75 color rgb Colour + <0, 0, 1>] }} }}
#end
#declare Across = function {{ 0.5 + 0.25 * x / (Half * Mm) }};
#declare Upward = function {{ 0.5 + 0.25 * y / (Half * Mm) }};
#declare Red = Ramp(Across, <2, 0, 0>)
#declare Green = Ramp(Upward, <0, 2, 0>)
plane {{
  z, -{distance} * Mm
  pigment {{ average pigment_map {{ [1 Red] [1 Green] }} }}
  finish {{ ambient 0 diffuse 0 emission 1 }}
}}
global_settings {{ max_trace_level 60 }}
camera {{ orthographic location {camera} * Mm * z direction -z right {width} * Mm * x up {width} * Mm * y }}
"""
PX = 100


def seen_mm(room: Room, lens: ImagingLens, *, scale: float) -> NDArray[np.float64]:
    """Return where POV-Ray's rays through a lens meet the target, (row, col, 2); NaN where they do not."""
    shutil.copytree(INCLUDE_FOLDER, room.bundle, dirs_exist_ok=True)
    rows = (
        (0 if math.isinf(one.radius_mm) else one.radius_mm, one.thickness_mm, one.index_after, one.semi_aperture_mm)
        for one in lens.surfaces
    )
    stop = f"Lippmann_Stop_Plate({lens.stop.z_mm}, {lens.stop.semi_aperture_mm}, 1000)" if lens.stop else ""
    text = TARGET.format(
        scale=scale,
        half=HALF_WIDTH_MM,
        count=len(lens.surfaces),
        rows=", ".join("{ " + ", ".join(map(repr, row)) + " }" for row in rows),
        stop=stop,
        distance=DISTANCE_MM,
        camera=lens.length_mm + 40,
        width=2 * lens.semi_aperture_mm,
    )
    codes = read_codes(room.render(text, cols=PX, rows=PX, picture="lens.ppm", picture_format="ppm16").picture)
    seen = codes[..., :2] / 65535 * 2 * HALF_WIDTH_MM - HALF_WIDTH_MM
    return np.where((codes[..., 2] > 32768)[..., np.newaxis], seen, np.nan)


def traced_mm(lens: ImagingLens) -> NDArray[np.float64]:
    """Return the same from the exact trace."""
    side = ((np.arange(PX) + 0.5) / PX - 0.5) * 2 * lens.semi_aperture_mm
    x, y = np.meshgrid(side, -side)
    start = np.stack([x, y, np.full_like(x, lens.length_mm + 40)], axis=-1)
    rays = through_lens(Rays(start, np.broadcast_to([0.0, 0.0, -1.0], start.shape)), lens, backward=True)
    return rays.at_z(-DISTANCE_MM)[..., :2]


def compare(seen: NDArray[np.float64], traced: NDArray[np.float64]) -> None:
    # A colour beyond the ramp's ends says nothing of the place.
    inside = ~(np.abs(traced) >= HALF_WIDTH_MM - 1).any(axis=-1)
    assert (np.isnan(seen) == np.isnan(traced))[inside].all()
    error_mm = np.hypot(*np.moveaxis(seen - traced, -1, 0))[inside]
    assert np.isfinite(error_mm).sum() > 500
    assert np.nanmedian(error_mm) <= MEDIAN_MM
    assert np.nanmax(error_mm) <= LARGEST_MM


@pytest.mark.parametrize("scale", [1.0, 1 / 25, 3.0])
@pytest.mark.parametrize("lens", [*IMAGING_LENSES.values(), BALL], ids=lambda lens: str(lens.name))
def test_a_lens_refracts_as_the_exact_trace_does(best: Room, lens: ImagingLens, scale: float) -> None:
    """Every ray, and every ray that an aperture ends: at scales of 25 mm, 1 mm and a third of it a unit."""
    compare(seen_mm(best, lens.built(), scale=scale), traced_mm(lens.built()))


@pytest.mark.parametrize("lens", [TRONNIER_1954, COOKE_TRIPLET], ids=lambda lens: str(lens.name))
def test_a_stop_ends_the_rays_that_it_should(best: Room, lens: ImagingLens) -> None:
    built = replace(lens, stop=Stop(stop_place_mm(lens), 3.0)).built()
    compare(seen_mm(best, built, scale=1.0), traced_mm(built))
    assert np.isnan(traced_mm(built)).sum() > np.isnan(traced_mm(lens.built())).sum() + 500


PRISM = """
#include "lippmann/glass.inc"
intersection {{
  plane {{ z, 0 }}
  plane {{ -z, 0 rotate 20 * y translate -10 * z }}
  texture {{ Lippmann_Clear }}
  Lippmann_Glass({index}, {dispersion})
}}
box {{
  <499.75, -1000, -1000.001>, <500.25, 1000, -1000>
  pigment {{ rgb 1 }} finish {{ ambient 0 diffuse 0 emission 1 }}
}}
background {{ rgb 0 }}
global_settings {{ max_trace_level 10 }}
camera {{ orthographic location <250, 0, 400> direction -z right 100 * x up 0.1 * y }}
"""


def test_a_prism_spreads_colours_as_the_abbe_number_says(best: Room) -> None:
    """A white line through a wedge: seven lines, one a band of POV-Ray's spectrum, where Snell's law puts them."""
    shutil.copytree(INCLUDE_FOLDER, best.bundle, dirs_exist_ok=True)
    index, dispersion = 1.7, povray_dispersion(1.7, 12.0)
    text = PRISM.format(index=index, dispersion=dispersion)
    outcome = best.render(text, cols=4000, rows=2, picture="prism.ppm", picture_format="ppm16")
    light = read_codes(outcome.picture)[0].sum(axis=-1, dtype=np.float64)
    lit = np.nonzero(light)[0]
    lines = np.split(lit, np.nonzero(np.diff(lit) > 1)[0] + 1)
    found_mm = [200 + 100 / 4000 * (np.average(line, weights=light[line]) + 0.5) for line in lines]
    bands_nm = 380 + 350 * (np.arange(7) + 0.5) / 7
    expected_mm = [_line_mm(povray_index(index, dispersion, float(band))) for band in bands_nm]
    assert found_mm == pytest.approx(expected_mm, abs=0.05)
    assert expected_mm[-1] - expected_mm[0] > 20


def _line_mm(index: float) -> float:
    """Return the x whose ray, entering the wedge squarely, leaves it toward x = 500 at z = -1000."""
    wedge = math.radians(20)
    bend = math.tan(math.asin(index * math.sin(wedge)) - wedge)
    # x + bend * (z + 1000) = 500 on the face z = -10 - x tan(wedge).
    return (500 - 990 * bend) / (1 - bend * math.tan(wedge))


DOUBLET = ImagingLens(
    "doublet",
    "A cemented pair that spreads colours widely",
    "",
    (
        Surface(150.0, 40.0, 1.7, 50.0, abbe_after=14.0),
        Surface(-300.0, 10.0, 1.6, 50.0, abbe_after=40.0),
        Surface(math.inf, 0.0, 1.0, 50.0),
    ),
)

SPECTRUM = """
#include "lippmann/glass.inc"
#include "lippmann/imaging_lens.inc"
#declare Surfaces = array[3][5] {{ {rows} }};
object {{ Lippmann_Imaging_Lens(Surfaces) }}
box {{ <99.9, -1000, -1000.001>, <100.1, 1000, -1000> pigment {{ rgb 1 }} finish {{ ambient 0 diffuse 0 emission 1 }} }}
background {{ rgb 0 }}
global_settings {{ max_trace_level 20 }}
camera {{ orthographic location <-25, 0, 90> direction -z right 40 * x up 0.02 * y }}
"""


def test_cemented_glass_spreads_colours_as_its_abbe_numbers_say(best: Room) -> None:
    shutil.copytree(INCLUDE_FOLDER, best.bundle, dirs_exist_ok=True)
    spread = [povray_dispersion(one.index_after, one.abbe_after) for one in DOUBLET.surfaces]
    rows = ", ".join(
        f"{{ {0 if math.isinf(one.radius_mm) else one.radius_mm}, {one.thickness_mm}, {one.index_after}, 50, {wide} }}"
        for one, wide in zip(DOUBLET.surfaces, spread, strict=True)
    )
    outcome = best.render(SPECTRUM.format(rows=rows), cols=4000, rows=2, picture="doublet.ppm", picture_format="ppm16")
    light = read_codes(outcome.picture)[0].sum(axis=-1, dtype=np.float64)
    lit = np.nonzero(light)[0]
    lines = np.split(lit, np.nonzero(np.diff(lit) > 1)[0] + 1)
    found_mm = [-45 + 40 / 4000 * (np.average(line, weights=light[line]) + 0.5) for line in lines]
    bands_nm = 380 + 350 * (np.arange(7) + 0.5) / 7
    expected_mm = [_camera_x_mm(float(band), spread) for band in bands_nm]
    assert sorted(found_mm) == pytest.approx(sorted(expected_mm), abs=0.02)
    assert abs(expected_mm[-1] - expected_mm[0]) > 1


def _camera_x_mm(wavelength_nm: float, spread: list[float]) -> float:
    """Return the x whose ray of one colour, parallel to the axis, meets x = 100 at z = -1000."""
    surfaces = tuple(
        replace(one, index_after=povray_index(one.index_after, wide, wavelength_nm) if wide != 1.0 else one.index_after)
        for one, wide in zip(DOUBLET.surfaces, spread, strict=True)
    )
    x = np.linspace(-45, -5, 2001)
    start = np.stack([x, np.zeros_like(x), np.full_like(x, 90.0)], axis=-1)
    down = np.broadcast_to([0.0, 0.0, -1.0], start.shape)
    met = through_lens(Rays(start, down), replace(DOUBLET, surfaces=surfaces), backward=True).at_z(-1000.0)[:, 0]
    return float(np.interp(-100.0, -met, x))


def surface(
    radius_mm: float | None, thickness_mm: float, index: float = 1.0, semi_aperture_mm: float = 40.0
) -> dict[str, Any]:
    return {
        "radius_mm": radius_mm,
        "thickness_mm": thickness_mm,
        "index": index,
        "semi_aperture_mm": semi_aperture_mm,
    }


def of_surfaces(*surfaces: dict[str, Any], **rig: Any) -> dict[str, Any]:
    return {"rig": {"imaging_lens": {"surfaces": surfaces}, **rig}}


CONVEX_PLANO = surface(120, 20, 1.6), surface(None, 0)
PLANO_CONVEX = surface(None, 20, 1.6), surface(-120, 0)
COINCIDENCES: dict[str, dict[str, Any]] = {
    "stop on a plane face": of_surfaces(*PLANO_CONVEX, f_number=8),
    "stop on a nearly plane face": of_surfaces(surface(3e5, 20, 1.6), PLANO_CONVEX[1], stop_mm=10),
    "stop between planes in contact": of_surfaces(*CONVEX_PLANO, *PLANO_CONVEX, stop_mm=20),
    "baffle on a plane face": of_surfaces(surface(None, 20, 1.6, 12), PLANO_CONVEX[1]),
    "baffle on a nearly plane face": of_surfaces(surface(1e6, 20, 1.6, 12), PLANO_CONVEX[1]),
    "baffle on cemented planes": of_surfaces(CONVEX_PLANO[0], surface(None, 10, 1.7, 8), surface(-400, 0)),
    "thin cement": of_surfaces(
        surface(150, 30, 1.6), surface(-100, 0.02, 1.55), surface(-100, 10, 1.7), surface(-400, 0)
    ),
    "microlens thicker than the way to the camera": {
        "count": (1, 1),
        "px_per_lens": 80,
        "lens_array": {"pitch_mm": 150, "focal_length_mm": 330, "offset_mm": 10},
    },
    "array wider than the baffles": {
        "count": (31, 31),
        "px_per_lens": 4,
        "lens_array": {"pitch_mm": 3, "focal_length_mm": 9.9, "offset_mm": 0},
        "rig": {"imaging_lens": {"name": "cooke-triplet", "focal_length_mm": 5}},
    },
}


@pytest.mark.parametrize("changes", COINCIDENCES.values(), ids=COINCIDENCES.keys())
def test_no_light_leaks_where_parts_of_a_rig_would_coincide_or_end(tmp_path: Path, changes: dict[str, Any]) -> None:
    parameters = {"half_width_mm": HALF_WIDTH_MM}
    rig = {"count": (16, 16), "capture": {"method": "glass"}} | changes
    spec = small_job("target-position", parameters=parameters, **rig)
    place = local_place(tmp_path)
    codes = rendered_codes(place, stored_job(place, spec))
    optical_bench = bench(spec.rig, reference_mm=1000.0)
    expected_mm = object_rays(optical_bench, pixel_centres_mm(optical_bench)).at_z(-1000.0)[..., :2]
    seen = (np.abs(expected_mm) < HALF_WIDTH_MM).all(axis=-1)
    found_mm = codes[..., :2] / 65535 * 2 * HALF_WIDTH_MM - HALF_WIDTH_MM
    assert seen.any()
    assert ((codes[..., 2] > 32768) == seen).all()
    error_mm = np.hypot(*np.moveaxis(found_mm - expected_mm, -1, 0))[seen]
    assert np.median(error_mm) <= MEDIAN_MM
    assert error_mm.max() <= LARGEST_MM


@pytest.mark.parametrize("rig", [{}, {"f_number": 4.0}], ids=["open", "stopped"])
def test_a_whole_rig_with_a_well_corrected_lens_maps_every_pixel(tmp_path: Path, rig: dict[str, float]) -> None:
    lens = {"name": "double-gauss-tronnier", "focal_length_mm": 300}
    spec = small_job(
        "target-position",
        parameters={"half_width_mm": HALF_WIDTH_MM},
        count=(20, 20),
        rig={"imaging_lens": lens, **rig},
        capture={"method": "glass"},
    )
    place = local_place(tmp_path)
    codes = rendered_codes(place, stored_job(place, spec))
    optical_bench = bench(spec.rig, reference_mm=1000.0)
    expected_mm = object_rays(optical_bench, pixel_centres_mm(optical_bench)).at_z(-1000.0)[..., :2]
    found_mm = codes[..., :2] / 65535 * 2 * HALF_WIDTH_MM - HALF_WIDTH_MM
    assert ((codes[..., 2] > 32768) == ~np.isnan(expected_mm[..., 0])).all()
    error_mm = np.hypot(*np.moveaxis(found_mm - expected_mm, -1, 0))
    assert (np.isnan(error_mm).mean() > 0.2) == bool(rig)
    assert np.nanmedian(error_mm) <= MEDIAN_MM
    assert np.nanmax(error_mm) <= LARGEST_MM
