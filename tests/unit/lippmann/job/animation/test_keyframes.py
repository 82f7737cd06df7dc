"""Numbers that change with the frame."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import SpecError
from lippmann.job.animation.keyframes import Keyframes
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import parse_scene
from lippmann.job.spec import JobSpec, parse_spec

OFFSETS = {"keyframes": [[1, 60], [2, 40], [3, 10], [4, -10]]}

keys = st.lists(
    st.tuples(st.integers(1, 200), st.floats(-1e3, 1e3)), min_size=1, max_size=8, unique_by=lambda key: key[0]
)


def job(**more: Any) -> dict[str, Any]:
    return {"scene": "fish", "frames": "1-4", **more}


@given(keys, st.sampled_from(["linear", "smooth"]))
def test_a_curve_passes_through_its_keys_and_stays_outside_them(points: list[tuple[int, float]], kind: str) -> None:
    rising = sorted(points)
    curve = Keyframes.model_validate({"keyframes": rising, "interpolation": kind})
    for frame, value in rising:
        assert curve.at(frame) == pytest.approx(value)
    assert curve.at(1) == pytest.approx(rising[0][1])
    assert curve.at(10_000) == rising[-1][1]


@given(keys, st.sampled_from(["linear", "smooth"]))
def test_no_curve_overshoots_its_keys(points: list[tuple[int, float]], kind: str) -> None:
    curve = Keyframes.model_validate({"keyframes": sorted(points), "interpolation": kind})
    for (begin, low), (end, high) in pairwise(sorted(points)):
        for frame in range(begin, end + 1):
            assert min(low, high) - 1e-9 <= curve.at(frame) <= max(low, high) + 1e-9


def test_a_smooth_curve_has_no_corner_at_a_key_and_a_linear_one_has() -> None:
    def bend(kind: str) -> float:
        curve = Keyframes.model_validate(
            {"keyframes": [[1, 0], [101, 100], [201, 120], [301, 125]], "interpolation": kind}
        )
        return abs((curve.at(102) - curve.at(101)) - (curve.at(101) - curve.at(100)))

    assert bend("smooth") < 0.05
    assert bend("linear") == pytest.approx(0.8)


def test_a_sweep_of_the_array_is_one_job() -> None:
    spec = parse_spec(job(rig={"lens_array": {"offset_mm": OFFSETS}}))
    assert [spec.at(frame).rig.lens_array.offset_mm for frame in spec.frame_numbers] == [60, 40, 10, -10]
    assert all(not spec.at(frame).animation for frame in spec.frame_numbers)


def test_an_animated_job_survives_its_own_json() -> None:
    spec = parse_spec(
        job(rig={"lens_array": {"offset_mm": OFFSETS}}, parameters={"turn": {"keyframes": [[1, 0], [9, 8]]}})
    )
    assert JobSpec.model_validate_json(spec.model_dump_json()) == spec
    assert parse_spec(spec.model_dump(mode="json")) == spec


def test_surfaces_of_a_lens_may_move() -> None:
    surfaces: list[dict[str, Any]] = [
        {"radius_mm": 100, "thickness_mm": 5, "index": 1.5, "semi_aperture_mm": 20},
        {"radius_mm": None, "thickness_mm": {"keyframes": [[1, 10], [3, 30]]}, "index": 1, "semi_aperture_mm": 20},
        {"radius_mm": 100, "thickness_mm": 5, "index": 1.5, "semi_aperture_mm": 20},
        {"radius_mm": None, "index": 1, "semi_aperture_mm": 20},
    ]
    spec = parse_spec(job(rig={"imaging_lens": {"surfaces": surfaces}}))
    lens = spec.at(2).rig.imaging_lens
    assert not isinstance(lens, str)
    assert lens is not None
    assert lens.model_dump()["surfaces"][1]["thickness_mm"] == 20


@pytest.mark.parametrize(
    ("rig", "field", "expected", "got"),
    [
        (
            {"lens_array": {"offset_mm": {"keyframes": [[3, 1], [2, 2]]}}},
            "rig.lens_array.offset_mm.keyframes",
            "frames that rise",
            "frame 2 after frame 3",
        ),
        (
            {"lens_array": {"pitch_mm": {"keyframes": [[1, 1], [2, -1]]}}},
            "rig.lens_array.pitch_mm",
            "a number above 0",
            "-1 at frame 2",
        ),
        (
            {"lens_array": {"offset_mm": {"keyframes": []}}},
            "rig.lens_array.offset_mm.keyframes",
            "at least 1 item",
            "[]",
        ),
        (
            {"lens_array": {"offset_mm": {"keyframes": "fast"}}},
            "rig.lens_array.offset_mm.keyframes",
            "a list",
            "'fast'",
        ),
        (
            {"lens_array": {"count": [{"keyframes": [[1, 8], [2, 9]]}, 8]}},
            "rig.lens_array.count.0",
            "how many pixels",
            "keyframes",
        ),
        ({"px_per_lens": {"keyframes": [[1, 8], [2, 9]]}}, "rig.px_per_lens", "how many pixels", "keyframes"),
        (
            {"lens_array": {"offset_mm": {"keyframes": [[1, 2]], "interpolation": "bouncy"}}},
            "rig.lens_array.offset_mm.interpolation",
            "'linear' or 'smooth'",
            "'bouncy'",
        ),
    ],
)
def test_keyframes_that_cannot_be_are_named(rig: dict[str, Any], field: str, expected: str, got: str) -> None:
    with pytest.raises(SpecError) as caught:
        parse_spec(job(rig=rig))
    (problem,) = caught.value.problems
    assert problem.field == field
    assert expected in problem.expected
    assert got in f"{problem.expected} {problem.got}"


STAGE = {"location": [0, 0, -1000], "look_at": [0, 0, 0], "reference_mm": 1000, "near_mm": 900, "far_mm": 2000}
CARD = parse_scene(
    {
        "title": "A",
        "stage": STAGE,
        "parameters": {"turn": {"type": "number", "default": 8.0, "minimum": 0, "maximum": 90}},
    }
)


def test_parameters_and_stage_move_with_the_frame() -> None:
    asked = job(
        parameters={"turn": {"keyframes": [[1, 0], [4, 30]]}},
        stage={"location": [{"keyframes": [[1, 0], [4, 6]]}, 0, -1000]},
    )
    sheet = ResolvedJob.of("j", parse_spec(asked), CARD, bundle="b")
    assert [sheet.at(frame).parameters["turn"] for frame in (1, 2, 4)] == [0, 10, 30]
    assert [sheet.at(frame).stage.location[0] for frame in (1, 2, 4)] == [0, 2, 6]
    assert ResolvedJob.model_validate_json(sheet.model_dump_json()) == sheet


def test_a_key_beyond_the_bounds_of_a_parameter_is_named_with_its_frame() -> None:
    spec = parse_spec(job(parameters={"turn": {"keyframes": [[1, 0], [2, 95], [4, 0]]}}))
    with pytest.raises(SpecError, match=r"parameters\.turn: expected number from 0\.0 to 90\.0, got 95\.0 at frame 2"):
        ResolvedJob.of("j", spec, CARD, bundle="b")


def test_a_stage_that_a_job_spoils_is_named() -> None:
    with pytest.raises(SpecError, match="stage: expected near_mm <= far_mm"):
        ResolvedJob.of("j", parse_spec(job(stage={"near_mm": 3000})), CARD, bundle="b")


@pytest.mark.parametrize(
    ("animation", "field"),
    [
        ({"stage.location.x": {"keyframes": [[1, 1]]}}, "stage.location.x"),
        ({"stage.location.-1": {"keyframes": [[1, 1]]}}, "stage.location.-1"),
        ({"rig.nothing": {"keyframes": [[1, 1]]}}, "rig.nothing"),
        ({"rig": {"keyframes": [[1, 1]]}}, "rig"),
        ({"priority": {"keyframes": [[1, 1]]}}, "priority"),
    ],
)
def test_keyframes_of_what_is_no_number_are_refused(animation: dict[str, Any], field: str) -> None:
    with pytest.raises(SpecError) as caught:
        parse_spec(job(stage={"location": [0, 0, -1000]}, animation=animation))
    assert field in {problem.field for problem in caught.value.problems}


@pytest.mark.parametrize(
    "rig", [{"dispersion": {"keyframes": [[1, 1], [3, 0]]}}, {"imaging_lens": {"keyframes": [[1, 2]]}}]
)
def test_switches_and_names_do_not_move(rig: dict[str, Any]) -> None:
    with pytest.raises(SpecError):
        parse_spec(job(rig=rig))


def test_a_constant_that_its_keyframes_would_overrule_is_refused() -> None:
    shown = parse_spec(job(rig={"lens_array": {"pitch_mm": {"keyframes": [[1, 1], [2, 2]]}}})).model_dump(mode="json")
    shown["rig"]["lens_array"]["pitch_mm"] = 1.5
    with pytest.raises(
        SpecError, match=r"rig\.lens_array\.pitch_mm: expected the first of its keyframes, 1, .* got 1\.5"
    ):
        parse_spec(shown)


def test_a_pitch_that_changes_how_many_pixels_a_device_needs_is_refused() -> None:
    pitch = {"keyframes": [[1, 1], [2, 2]]}
    with pytest.raises(SpecError, match="does not change how many pixels"):
        parse_spec(job(rig={"lens_array": {"pitch_mm": pitch}, "device": {"dpi": 300}}))


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ([[1, 1], [10**400, 3]], "a number of at most 999999"),
        ([[1, 1e308], [2, -1e308]], "a number of at most"),
        ([[frame, 0] for frame in range(1, 1002)], "at most 1000 items"),
    ],
)
def test_keys_out_of_all_bounds_are_refused(keys: list[Any], expected: str) -> None:
    with pytest.raises(SpecError, match=expected):
        parse_spec(job(rig={"lens_array": {"offset_mm": {"keyframes": keys}}}))


def test_a_job_nested_without_end_is_refused() -> None:
    nested: dict[str, Any] = {}
    for _ in range(900):
        nested = {"rig": nested}
    with pytest.raises(SpecError):
        parse_spec(job(rig=nested))


@pytest.mark.parametrize("kind", ["integer", "boolean"])
def test_parameters_without_values_between_do_not_move(kind: str) -> None:
    default = 1 if kind == "integer" else True
    card = parse_scene({"title": "A", "stage": STAGE, "parameters": {"n": {"type": kind, "default": default}}})
    spec = parse_spec(job(parameters={"n": {"keyframes": [[1, 1], [4, 2]]}}))
    with pytest.raises(SpecError, match=rf"parameters\.n: expected a parameter of type number .* got type {kind}"):
        ResolvedJob.of("j", spec, card, bundle="b")
