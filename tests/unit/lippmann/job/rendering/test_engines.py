"""The wishes of a job are compared with the abilities of the engine of its scene."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.errors import SpecError
from lippmann.job.rendering.engines import Engine
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import SceneManifest
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import parse_spec

STAGE = Stage(location=(0, 0, -10), look_at=(0, 0, 0), near_mm=900, far_mm=1100)
POVRAY, MITSUBA = "scene.inc", "scene.xml"


def resolved(file: str, **job: Any) -> ResolvedJob:
    manifest = SceneManifest(title="A", stage=STAGE).model_copy(update={"file": file})
    return ResolvedJob.of("j", parse_spec({"scene": "mine", **job}), manifest, bundle="b")


@pytest.mark.parametrize(
    ("file", "engine"),
    [
        ("scene.inc", "povray"), ("a/b.POV", "povray"), ("scene.xml", "mitsuba"), ("fish.glb", "mitsuba"),
        ("room.ply", "mitsuba"),
    ],
)  # fmt: skip
def test_the_scene_file_chooses_the_engine(file: str, engine: Engine) -> None:
    assert resolved(file).engine == engine
    assert resolved(file, render={"engine": engine}).engine == engine
    assert resolved(file, render={"engine": engine}).at(1).engine == engine


@pytest.mark.parametrize(
    ("file", "job", "message"),
    [
        (POVRAY, {"render": {"engine": "mitsuba"}}, "render.engine: expected auto or povray, because scene.inc is"),
        (MITSUBA, {"render": {"engine": "povray"}}, "render.engine: expected auto or mitsuba, because scene.xml is"),
        (POVRAY, {"render": {"samples": 2}}, "render.samples: expected 1 with POV-Ray"),
        (POVRAY, {"render": {"path_depth": 9}}, "render.path_depth: expected 8"),
        (POVRAY, {"render": {"clamp": 4.0}}, "render.clamp: expected null with POV-Ray"),
        (POVRAY, {"capture": {"channels": ["depth", "normal"]}}, "capture.channels: expected depth alone"),
        (MITSUBA, {"capture": {"method": "glass"}}, "capture.method: expected auto or ray_camera with Mitsuba"),
        (MITSUBA, {"render": {"antialias": {}}}, "render.antialias: expected off with Mitsuba"),
        (MITSUBA, {"stage": {"follow_camera": True}}, "stage.follow_camera: expected false with Mitsuba"),
    ],
)
def test_what_an_engine_cannot_do_is_refused_by_its_field(file: str, job: dict[str, Any], message: str) -> None:
    with pytest.raises(SpecError) as refused:
        resolved(file, **job)
    assert [problem.field for problem in refused.value.problems] == [message.partition(":")[0]]
    assert message in refused.value.message


def test_each_engine_renders_what_the_other_cannot() -> None:
    assert resolved(MITSUBA, render={"samples": 1024, "path_depth": 64, "clamp": 4.0}).spec.render.samples == 1024
    assert resolved(POVRAY, capture={"method": "glass"}, rig={"dispersion": True}).spec.rig.dispersion


def test_the_channel_of_depth_is_the_depth_of_the_capture() -> None:
    assert parse_spec({"scene": "a", "capture": {"channels": ["depth"]}}).capture.depth
    assert not parse_spec({"scene": "a", "capture": {"channels": ["normal"]}}).capture.depth


def test_mitsuba_renders_every_channel() -> None:
    channels = ("depth", "normal", "albedo", "object", "motion")
    assert resolved(MITSUBA, capture={"channels": channels}).spec.capture.channels == channels


@pytest.mark.parametrize(
    ("field", "job"),
    [
        ("capture.depth", {"capture": {"channels": ["depth"], "depth": False}}),
        ("capture.channels", {"capture": {"channels": ["normal", "normal"]}}),
        ("capture.channels.0", {"capture": {"channels": ["colour"]}}),
        ("render.samples", {"render": {"samples": 0}}),
        ("render.samples", {"render": {"samples": 1025}}),
        ("render.path_depth", {"render": {"path_depth": 0}}),
        ("render.clamp", {"render": {"clamp": 0}}),
        ("render.engine", {"render": {"engine": "blender"}}),
    ],
)
def test_wrong_values_are_refused_by_their_field(field: str, job: dict[str, Any]) -> None:
    with pytest.raises(SpecError) as refused:
        parse_spec({"scene": "a", **job})
    assert [problem.field for problem in refused.value.problems] == [field]
