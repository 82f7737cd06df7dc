"""`lippmann scenes init` for a glTF model: the rig by its camera or box, the clock by its animation."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import BadInput
from lippmann.job.scenes.scene import SceneManifest, parse_scene
from lippmann.local.scenes.scene_init import RIG_TANGENT, init_scene
from tests.unit.worker.engines.mitsuba.inside.scenes.glb import Glb, square


def written(tmp_path: Path, glb: Glb) -> SceneManifest:
    (tmp_path / "a.glb").write_bytes(glb.data())
    return parse_scene(tomllib.loads(init_scene(tmp_path / "a.glb").file.read_text()))


def test_a_model_without_a_camera_fills_the_picture_of_a_rig_before_its_box(tmp_path: Path) -> None:
    glb = square()
    glb.document["nodes"][0] |= {"scale": [0.1, 0.2, 1], "translation": [5, 0, 0]}
    scene = written(tmp_path, glb)
    stage = scene.stage
    assert [scene.file, scene.engine, stage.handedness] == ["a.glb", "mitsuba", "right"]
    assert list(stage.look_at) == [5.0, 0.0, 0.0]
    assert stage.location == pytest.approx((5, 0, 1.1 * 0.2 / RIG_TANGENT), rel=1e-4)
    assert stage.location[2] * stage.mm_per_unit == pytest.approx(1000, rel=1e-4)
    assert [stage.near_mm, stage.far_mm] == [1000.0, 1000.0]
    assert scene.clock.last is None


def test_the_rig_sees_what_a_camera_of_the_file_sees(tmp_path: Path) -> None:
    glb = square()
    turn = [0, math.sin(math.pi / 4), 0, math.cos(math.pi / 4)]
    glb.document["nodes"].append({"camera": 0, "translation": [4, 0, 0], "rotation": turn})
    glb.document["scenes"] = [{"nodes": [0, 1]}]
    glb.document["cameras"] = [{"type": "perspective", "perspective": {"yfov": 2 * math.atan(0.3)}}]
    stage = written(tmp_path, glb).stage
    assert stage.location == pytest.approx((8, 0, 0), abs=1e-4)
    assert np.subtract(stage.look_at, stage.location)[0] < 0
    assert stage.near_mm == 1000
    # The square reaches from 7 to 9 units before the rig.
    assert stage.far_mm == 1300
    assert stage.mm_per_unit == pytest.approx(1000 / 7, rel=1e-3)


def test_the_clock_is_the_length_of_the_animation_and_the_box_holds_its_movement(tmp_path: Path) -> None:
    glb = square()
    sampler = {"input": glb.accessor([0, 2]), "output": glb.accessor([(0, 0, 0), (6, 0, 0)])}
    glb.document["accessors"][sampler["input"]] |= {"min": [0], "max": [2]}
    channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
    glb.document["animations"] = [{"samplers": [sampler], "channels": [channel]}]
    scene = written(tmp_path, glb)
    assert [scene.clock.at(1), scene.clock.at(61)] == pytest.approx([0.0, 2.0])
    assert scene.clock.frames == 61
    assert list(scene.stage.look_at) == [3.0, 0.0, 0.0]


def test_a_damaged_model_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    glb = square()
    del glb.document["accessors"][0]["max"]
    (tmp_path / "a.glb").write_bytes(glb.data())
    with pytest.raises(BadInput, match=r"a\.glb: accessors\.0: expected min and max"):
        init_scene(tmp_path / "a.glb")
    (tmp_path / "a.glb").write_bytes(b"glTF")
    with pytest.raises(BadInput, match=r"a\.glb: header: expected version 2"):
        init_scene(tmp_path / "a.glb")
    assert [path.name for path in tmp_path.iterdir()] == ["a.glb"]
