"""The one door for jobs: every wrong field is named with what was expected and what came."""

from __future__ import annotations

import json
from typing import Any

import pytest

from lippmann.errors import SpecError
from lippmann.job.presets import JOBS
from lippmann.job.spec import JobSpec, parse_spec

PAPER_IV: dict[str, Any] = {
    "scene": "fish",
    "parameters": {"turn_deg_per_frame": 8},
    "frames": "1-6",
    "fps": 8,
    "rig": {
        "imaging_lens": "athineos-2006",
        "lens_array": {
            "lattice": "square",
            "count": [90, 90],
            "pitch_mm": 1.0,
            "focal_length_mm": 3.3,
            "index": 1.49,
            "aperture": "full",
            "offset_mm": 40,
        },
        "camera": {"projection": "orthographic"},
        "px_per_lens": 8,
    },
    "render": {"antialias": "off"},
    "priority": 50,
    "outputs": ["views.mp4", "centre.mp4", "orthoscopic.mkv"],
}


def test_the_papers_job_file_is_understood() -> None:
    spec = parse_spec(PAPER_IV)
    assert spec.frame_numbers == (1, 2, 3, 4, 5, 6)
    assert spec.rig.lens_array.count == (90, 90)


def test_a_job_of_a_scene_alone_is_the_papers_one_frame() -> None:
    assert parse_spec({"scene": "fish"}).rig == parse_spec(PAPER_IV).rig


def test_writing_and_reading_a_job_are_inverse() -> None:
    spec = parse_spec(PAPER_IV)
    assert parse_spec(json.loads(spec.model_dump_json())) == spec


@pytest.mark.parametrize(
    ("change", "field", "expected", "got"),
    [
        ({"scne": 1}, "scne", "no field of this name (did you mean scene?)", "1"),
        ({"rig": {"lens_aray": {}}}, "rig.lens_aray", "no field of this name (did you mean lens_array?)", "{}"),
        ({"rig": {"lens_array": {"pich_mm": 1}}}, "rig.lens_array.pich_mm", "(did you mean pitch_mm?)", "1"),
        ({"outputs": [{"kind": "view_grid", "bit": 8}]}, "outputs.0.bit", "no field of this name", "8"),
        ({"colour": 1}, "colour", "no field of this name", "1"),
        ({"rig": {"lens_array": {"count": [0, 90]}}}, "rig.lens_array.count.0", "a number of at least 1", "0"),
        ({"rig": {"px_per_lens": 1}}, "rig.px_per_lens", "a number of at least 2", "1"),
        ({"rig": {"lens_array": {"pitch_mm": float("nan")}}}, "rig.lens_array.pitch_mm", "finite number", "nan"),
        ({"frames": "7-3"}, "frames", "a range that counts up", "'7-3'"),
        ({"outputs": ["views.gif"]}, "outputs.0", "'views.mp4'", "'views.gif'"),
        ({"outputs": ["views.mp4", "views.mp4"]}, "outputs.1.name", "a name of its own", "'views'"),
        ({"scene": "../fish"}, "scene", "lower-case letters", "'../fish'"),
        ({"fps": 0}, "fps", "a number above 0", "0"),
        (
            {"rig": {"lens_array": {"count": [4000, 90]}, "px_per_lens": 20}},
            "rig.px_per_lens",
            "at most 32768 px a side",
            "80000",
        ),
        ({"rig": {"lens_array": {"index": 0.9}}}, "rig.lens_array.index", "a number above 1", "0.9"),
        ({"rig": {"lens_array": {"preset": "630"}}}, "rig.lens_array.preset", "fresnel-technologies-630", "'630'"),
        ({"rig": {"lens_array": {"lattice": "hexagonal"}, "px_per_lens": 7}}, "rig.px_per_lens", "even", "7"),
        ({"rig": {"device": {}}}, "rig.device.dpi", "pitch_um", "neither"),
        ({"rig": {"device": {"dpi": 600, "pitch_um": 42}}}, "rig.device.dpi", "pitch_um", "both"),
        (
            {"rig": {"device": {"dpi": 600, "window_px": [9, 9], "margin_px": 1}}},
            "rig.device.margin_px",
            "window_px",
            "both",
        ),
        ({"rig": {"f_number": 2, "stop_mm": 50}}, "rig.f_number", "stop_mm", "both"),
        ({"rig": {"imaging_lens": None, "f_number": 2}}, "rig.f_number", "an imaging lens for the stop", "null"),
        ({"rig": {"imaging_lens": {"name": "x"}}}, "rig.imaging_lens.focal_length_mm", "a value", "nothing"),
        ({"rig": {"imaging_lens": 3}}, "rig.imaging_lens", "text", "3"),
        ({"capture": {"supersample": 9}}, "capture.supersample", "a number of at most 8", "9"),
        ({"capture": {"method": "magic"}}, "capture.method", "'ray_camera'", "'magic'"),
        ({"render": {"antialias": "on"}}, "render.antialias", "'off'", "'on'"),
        ({"render": {"antialias": {"threshold": 3}}}, "render.antialias.threshold", "a number below 1", "3"),
        (
            {"render": {"antialias": {"method": 1}, "tiles": [2, 1]}},
            "render.tiles",
            "method 1, which leaves seams",
            "(2, 1)",
        ),
        (
            {"capture": {"method": "ray_camera"}, "render": {"antialias": {}}},
            "render.antialias",
            "capture.supersample is for it",
            "on",
        ),
        ({"capture": {"bands": 1}}, "capture.bands", "a number of at least 2", "1"),
        ({"capture": {"bands": 33}}, "capture.bands", "a number of at most 32", "33"),
        (
            {"rig": {"px_per_lens": 200}, "capture": {"supersample": 2}},
            "capture.supersample",
            "supersample of at most",
            "36000 px",
        ),
        ({"stage": {"near_mm": -1}}, "stage.near_mm", "a number above 0", "-1"),
        ({"stage": {"far_mm": 1e300}}, "stage.far_mm", "a number of at most 1000000000", "1e+300"),
        ({"rig": {"camera": {"angle_deg": 1e-6}}}, "rig.camera.angle_deg", "a number of at least 0.001", "1e-06"),
        ({"display": {"viewing_distance_mm": 0}}, "display.viewing_distance_mm", "a number above 0", "0"),
    ],
)
def test_a_wrong_field_is_named(change: dict[str, Any], field: str, expected: str, got: str) -> None:
    with pytest.raises(SpecError) as caught:
        parse_spec({"scene": "fish"} | change)
    (problem,) = caught.value.problems
    assert problem.field == field
    assert expected in problem.expected
    assert got in problem.got + problem.expected
    assert field in caught.value.message


def test_a_preset_gives_what_is_not_said() -> None:
    spec = parse_spec({"scene": "fish", "rig": {"lens_array": {"preset": "fresnel-technologies-630", "index": 1.5}}})
    array = spec.rig.lens_array
    assert (array.pitch_mm, array.focal_length_mm, array.substrate_mm, array.index) == (1.0, 3.3, 3.3, 1.5)
    assert parse_spec(spec.model_dump(mode="json")) == spec


@pytest.mark.parametrize(
    ("rig", "px_per_lens"),
    [
        ({}, 8),
        ({"device": {"dpi": 600}}, 24),
        ({"device": {"dpi": 203}}, 8),
        ({"device": {"pitch_um": 42.3}}, 24),
        ({"device": {"dpi": 600}, "px_per_lens": 12}, 12),
        ({"device": {"dpi": 600}, "lens_array": {"pitch_mm": 2}}, 48),
        ({"device": {"dpi": 600}, "lens_array": {"lattice": "hexagonal", "pitch_mm": 1.05}}, 26),
    ],
)
def test_a_device_says_how_many_pixels_a_lens_needs(rig: dict[str, Any], px_per_lens: int) -> None:
    assert parse_spec({"scene": "fish", "rig": rig}).rig.px_per_lens == px_per_lens


@pytest.mark.parametrize(("name", "px_per_lens"), [("paper-still", 24), ("paper-iv", 8)])
def test_the_jobs_of_the_paper_are_right(name: str, px_per_lens: int) -> None:
    spec = parse_spec(JOBS[name])
    assert spec.rig.lens_array.preset == "fresnel-technologies-630"
    assert spec.rig.px_per_lens == px_per_lens


def test_all_wrong_fields_are_named_at_once() -> None:
    with pytest.raises(SpecError) as caught:
        parse_spec({"frames": "x", "rig": {"px_per_lens": 1}, "colour": "red"})
    assert {problem.field for problem in caught.value.problems} == {"scene", "frames", "rig.px_per_lens", "colour"}


@pytest.mark.parametrize("data", [None, [], "fish", 3])
def test_what_is_no_object_is_refused(data: object) -> None:
    with pytest.raises(SpecError, match="expected a job as a JSON object"):
        parse_spec(data)


def test_a_job_cannot_be_changed_after_the_door() -> None:
    spec: Any = parse_spec({"scene": "fish"})
    with pytest.raises(Exception, match="frozen"):
        spec.priority = 3
    assert isinstance(spec, JobSpec)
