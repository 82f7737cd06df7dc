"""Designs: the numbers of the paper to all digits that are published, an independent package, and every form of rig."""

from __future__ import annotations

import json
import math
import re
import tomllib
from typing import Any

import pytest
from raytracing import DielectricInterface, ImagingPath, Space

from lippmann.errors import SpecError
from lippmann.job.presets import JOBS
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import SceneManifest
from lippmann.job.spec import parse_spec
from lippmann.optics.lens.prescription import IMAGING_LENSES
from lippmann.optics.rig.method import Method
from lippmann.plan.design.design import Design
from lippmann.plan.design.designer import design
from lippmann.plan.design.display import device_cells_px
from lippmann.plan.design.estimate import START_S, estimate
from povtemplates.catalogue import scene_folders
from tests.repository import DOCS

FISH = SceneManifest.model_validate(tomllib.loads((scene_folders()["fish"] / "scene.toml").read_text()))


def designed(job: Any, *, frame: int | None = None) -> Design:
    return design(ResolvedJob.of("design", parse_spec(job), FISH, bundle=""), frame=frame)


def of_rig(**rig: Any) -> Design:
    return designed({"scene": "fish", "rig": rig})


STILL, VIDEO = designed(JOBS["paper-still"]), designed(JOBS["paper-iv"])

# All digits that are known, and how far off the last one may be.
GOLDEN = {
    "efl_mm": (300.46784621322, 1e-10),
    "back_focal_distance_mm": (98.89261626115, 1e-10),
    "front_focal_distance_mm": (56.55572355708, 1e-10),
    "f_number": (1.502, 5e-4),
    "image_near_mm": (184.34095, 5.1e-6),
    "image_far_mm": (134.20611, 5.1e-6),
    "image_depth_mm": (50.1348, 5.1e-5),
    "depth_compression": (29.92, 5e-3),
    "mean_magnification": (0.20096, 5e-6),
    "lens_radius_mm": (1.617, 1e-9),
    "displacement_mm": (1.454197, 5.1e-7),
    "gap_real_mm": (3.71477, 5.1e-6),
    "gap_virtual_mm": (2.21477, 5.1e-6),
    "gap_collimated_mm": (3.3, 1e-12),
    "gap_real_physical_mm": (4.8, 0.0),
    "gap_virtual_physical_mm": (3.3, 0.0),
    "gap_collimated_physical_mm": (4.385, 5e-4),
    "central_depth_plane_real_mm": (29.556, 5.1e-4),
    "central_depth_plane_virtual_mm": (-6.735, 5.1e-4),
    "viewing_angle_deg": (15.33, 5.1e-3),
    "viewing_angle_virtual_deg": (25.44, 5.1e-3),
    "viewing_angle_collimated_deg": (17.2, 5e-2),
    "mla_f_number": (3.3, 1e-12),
}


@pytest.mark.parametrize("key", GOLDEN)
@pytest.mark.parametrize("found", [STILL, VIDEO], ids=["paper-still", "paper-iv"])
def test_the_paper_s_presets_give_the_published_numbers(found: Design, key: str) -> None:
    value, tolerance = GOLDEN[key]
    assert getattr(found, key) == pytest.approx(value, abs=tolerance)


@pytest.mark.parametrize(
    ("object_mm", "image_mm", "magnification"),
    [
        (1000.0, 184.34095, -0.2843843),
        (1250.0, 167.99103, -0.229969),
        (1500.0, 156.89306, -0.193034),
        (1750.0, 148.86668, -0.166321),
        (2500.0, 134.20611, -0.117528),
    ],
)
def test_conjugates_are_the_published_ones(object_mm: float, image_mm: float, magnification: float) -> None:
    found = designed({"scene": "fish", "stage": {"reference_mm": object_mm}}).conjugates
    assert found is not None
    assert found.reference.image_mm == pytest.approx(image_mm, abs=5.1e-6)
    assert found.reference.magnification == pytest.approx(magnification, abs=5.1e-7)


@pytest.mark.parametrize(
    ("height_mm", "image_mm", "tolerance_mm"),
    [(10.0, 183.947, 5.1e-4), (40.0, 177.995222516, 5.1e-10), (50.0, 174.384, 5.1e-4), (100.0, 142.839, 5.1e-4)],
)
def test_exact_rays_cross_the_axis_where_published(height_mm: float, image_mm: float, tolerance_mm: float) -> None:
    found = {(ray.object_mm, ray.height_mm): ray for ray in STILL.axis_crossings}
    assert found[1000.0, height_mm].image_mm == pytest.approx(image_mm, abs=tolerance_mm)


@pytest.mark.parametrize(
    ("lattice", "aperture", "displacement_mm"),
    [
        ("square", "inscribed", 1.537755),
        ("square", "full", 1.454197),
        ("hexagonal", "full", 1.510416),
    ],
)
def test_lenses_are_cut_where_published(lattice: str, aperture: str, displacement_mm: float) -> None:
    found = of_rig(lens_array={"lattice": lattice, "aperture": aperture})
    assert found.displacement_mm == pytest.approx(displacement_mm, abs=5.1e-7)


def test_the_still_s_camera_window_margin_and_cells_are_the_paper_s() -> None:
    assert STILL.camera_distance_mm == pytest.approx(862.9, abs=0.05)
    assert (STILL.device_rows_px, STILL.device_cols_px, STILL.margin_px) == (2400, 2400, 19)
    assert (STILL.device_cells_px, STILL.px_per_lens) == ((23, 24), 24)
    assert (STILL.width_mm, STILL.height_mm) == pytest.approx((101.6, 101.6))
    assert (STILL.views, STILL.view_rows_px, STILL.view_cols_px) == (576, 100, 100)


def test_the_video_has_the_paper_s_pixels_and_views() -> None:
    assert (VIDEO.rows_px, VIDEO.cols_px, VIDEO.px_per_lens, VIDEO.views) == (720, 720, 8, 64)
    assert (VIDEO.device_cells_px, VIDEO.margin_px, VIDEO.frames) == ((8,), 0, 45)


def test_the_print_is_deep_enough_for_the_paper_s_image_and_the_panel_just_not() -> None:
    assert STILL.depth_budget == "fits"
    assert (STILL.resolvable_front_mm, STILL.resolvable_back_mm) == pytest.approx((72.0, 85.0), abs=0.5)
    panel = designed({**JOBS["paper-still"], "rig": {**JOBS["paper-still"]["rig"], "device": {"dpi": 203}}})
    assert (panel.resolvable_front_mm, panel.resolvable_back_mm) == pytest.approx((26.0, 27.0), abs=0.5)
    assert panel.depth_budget == "exceeded"
    assert panel.depth_budget_words in panel.warnings
    middle = {"preset": "fresnel-technologies-630", "offset_mm": 25.0}
    just = designed({"scene": "fish", "rig": {"lens_array": middle, "device": {"dpi": 203}}})
    assert just.depth_budget == "fits"


@pytest.mark.parametrize("name", IMAGING_LENSES)
def test_focal_lengths_and_conjugates_equal_those_of_the_raytracing_package(name: str) -> None:
    lens, index = IMAGING_LENSES[name], 1.0
    path = ImagingPath()
    path.append(Space(d=1000.0))
    for surface in lens.surfaces:
        path.append(DielectricInterface(R=surface.radius_mm, n1=index, n2=surface.index_after))
        path.append(Space(d=surface.thickness_mm, n=surface.index_after))
        index = surface.index_after
    matrix = path.transferMatrix()
    found = designed({"scene": "fish", "rig": {"imaging_lens": name, "lens_array": {"count": [8, 8], "offset_mm": 1}}})
    assert found.conjugates is not None
    assert found.efl_mm == pytest.approx(-1 / matrix.C, rel=1e-9)
    assert found.conjugates.near.image_mm == pytest.approx(-matrix.B / matrix.D, rel=1e-9)
    assert found.conjugates.near.magnification == pytest.approx(1 / matrix.D, rel=1e-9)


@pytest.mark.parametrize(("offset_mm", "place"), [(60.0, "real"), (40.0, "mixed"), (10.0, "mixed"), (-10.0, "virtual")])
def test_the_four_places_of_the_paper_s_array(offset_mm: float, place: str) -> None:
    found = of_rig(lens_array={"offset_mm": offset_mm})
    assert found.mla_place == place
    assert found.s_reference_mm == pytest.approx(offset_mm, abs=1e-9)
    assert found.mla_behind_lens_mm == pytest.approx(184.34095 - offset_mm, abs=5.1e-6)


def test_gaps_that_are_not_given_serve_the_middle_of_what_is_shown() -> None:
    found = of_rig(lens_array={"offset_mm": 40.0})
    assert found.s_far_mm is not None
    assert found.central_depth_plane_real_mm == pytest.approx(20.0)
    assert found.central_depth_plane_virtual_mm == pytest.approx(found.s_far_mm / 2)
    assert found.viewing_angle_deg == found.viewing_angle_real_deg
    behind = of_rig(lens_array={"offset_mm": -10.0})
    assert (behind.gap_real_mm, behind.central_depth_plane_real_mm) == (3.3, None)
    assert behind.viewing_angle_deg == behind.viewing_angle_virtual_deg


def test_a_gap_thinner_than_the_substrate_is_said() -> None:
    found = designed({**JOBS["paper-still"], "display": {"gap_virtual_mm": 2.0}})
    assert any("display.gap_virtual_mm of 2 mm" in warning for warning in found.warnings)


def test_a_stop_slower_than_the_array_is_said_in_words() -> None:
    assert "narrower" in str(of_rig(f_number=8.0).f_number_match)
    assert "wider" in str(of_rig().f_number_match)


def test_direct_pickup_has_no_lens_and_everything_else() -> None:
    found = of_rig(imaging_lens=None, lens_array={"offset_mm": -20.0})
    assert (found.efl_mm, found.conjugates, found.exact_s_near_mm, found.mla_behind_lens_mm) == (None,) * 4
    assert (found.s_near_mm, found.s_far_mm, found.mla_place) == (-20.0, -1520.0, "virtual")
    assert found.exact_disparity_near == pytest.approx(found.disparity_near, rel=0.15)


def test_with_the_exact_trace_the_image_lies_nearer_by_spherical_aberration() -> None:
    assert STILL.exact_image_near_mm is not None
    assert STILL.image_near_mm is not None
    assert STILL.exact_image_near_mm - STILL.image_near_mm == pytest.approx(-6.35, abs=0.5)


def test_an_animated_job_is_designed_at_the_frame_that_is_asked_for() -> None:
    sweep = {"keyframes": [[1, 60], [4, -10]], "interpolation": "linear"}
    job = {"scene": "fish", "frames": "1-4", "rig": {"lens_array": {"offset_mm": sweep}}}
    assert [designed(job, frame=frame).s_reference_mm for frame in (None, 1, 4)] == pytest.approx([60.0, 60.0, -10.0])
    assert (designed(job).frame, designed(job, frame=4).frame) == (1, 4)


def test_what_cannot_be_built_has_no_design() -> None:
    with pytest.raises(SpecError) as refused:
        of_rig(lens_array={"pitch_mm": 3.0})
    assert refused.value.problems[0].field == "rig.lens_array.pitch_mm"


@pytest.mark.parametrize(
    "job",
    [
        {"stage": {"near_mm": 50.0}},
        {"stage": {"near_mm": 1000.0, "far_mm": 1000.0}},
        {"stage": {"far_mm": 1e9}},
        {"rig": {"lens_array": {"count": [1, 1]}}},
        {"rig": {"lens_array": {"count": [4096, 4096], "pitch_mm": 0.02, "focal_length_mm": 0.1}}},
        {"rig": {"lens_array": {"lattice": "hexagonal"}, "device": {"pitch_um": 50}}},
        {"rig": {"camera": {"projection": "perspective"}}},
    ],
    ids=str,
)  # fmt: skip
def test_every_number_is_one_that_json_has(job: dict[str, Any]) -> None:
    found = designed({"scene": "fish", **job})
    assert json.loads(json.dumps(found.model_dump(mode="json"), allow_nan=False)) == found.model_dump(mode="json")


@pytest.mark.parametrize("lens_cols", [1, 2, 7, 100])
@pytest.mark.parametrize("pixel_um", [30.0, 42.333333, 125.0, 400.0])
def test_cells_on_a_device_are_the_pitch_rounded_down_or_up(lens_cols: int, pixel_um: float) -> None:
    d = 1000.0 / pixel_um
    cells = device_cells_px(lens_cols, cols_px=round(lens_cols * d), px_per_lens_device=d)
    assert set(cells) <= {math.floor(d), math.ceil(d)}


def test_time_and_memory_grow_with_the_pixels_that_are_rendered() -> None:
    one, four = (estimate(parse_spec({"scene": "fish", "capture": {"supersample": k}}), "glass") for k in (1, 2))
    assert (four.frame_cpu_s - START_S) / (one.frame_cpu_s - START_S) == pytest.approx(4.0)
    assert one.sheet_mb == pytest.approx(720 * 720 * 6 / 1e6)


def test_a_device_that_shows_more_pixels_than_are_rendered_is_said() -> None:
    found = of_rig(px_per_lens=8, device={"dpi": 600})
    assert any("only 8 are rendered" in warning for warning in found.warnings)


def test_every_number_is_defined_in_the_docs() -> None:
    page = (DOCS / "designer.md").read_text()
    assert set(Design.model_fields) <= set(re.findall(r"`([a-z_]+)`", page))


@pytest.mark.parametrize(
    ("lenses", "px_per_lens", "method", "measured_s"),
    [
        (90, 8, "glass", 6.7),
        (60, 24, "glass", 25.8),
        (100, 24, "glass", 59.8),
        (60, 24, "ray_camera", 18.4),
    ],
)
def test_estimates_are_near_what_was_measured(lenses: int, px_per_lens: int, method: Method, measured_s: float) -> None:
    job = {"scene": "fish", "rig": {"lens_array": {"count": [lenses, lenses]}, "px_per_lens": px_per_lens}}
    assert estimate(parse_spec(job), method).frame_cpu_s == pytest.approx(measured_s, rel=0.15)
