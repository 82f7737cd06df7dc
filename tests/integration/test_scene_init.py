"""`lippmann scenes init`: a scene.toml from the scene's own camera, with which the scene is captured."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import BadInput, SceneError
from lippmann.job.scenes.scene import parse_scene
from lippmann.local.files.bundle import find_bundle
from lippmann.local.scenes.scene_init import init_scene
from worker.sandbox.bundle import check_bundle

BALLS = """#version 3.7; global_settings { assumed_gamma 1 }
camera { location <0, 0, -10> right -x * 4/3 up y angle 45 look_at 0 rotate 90 * clock * y }
light_source { <10, 20, -30> 1 }
sphere { 0, 1 pigment { rgb <1, 0, 0> } } box { <-9, -9, 4>, <9, 9, 5> pigment { rgb 1 } }
"""


def test_a_scene_toml_says_where_the_rig_sees_what_the_camera_sees(tmp_path: Path) -> None:
    (tmp_path / "balls.pov").write_text(BALLS)
    made = init_scene(tmp_path / "balls.pov")
    scene = parse_scene(tomllib.loads(made.file.read_text()))
    stage = scene.stage
    assert (scene.file, stage.up, stage.follow_camera, scene.clock.last) == ("balls.pov", (0, 1, 0), True, 1.0)
    # The middle of what the camera sees is the wall, 14 units away, and the wall or ball begins at 9 units.
    assert np.array(stage.look_at) == pytest.approx(np.array([0, 0, 4]), abs=0.05)
    back = 14 * (np.tan(np.radians(22.5)) / 0.15 - 1)
    assert np.array(stage.location) == pytest.approx(np.array([0, 0, -10 - back]), abs=0.2)
    assert stage.mm_per_unit == pytest.approx(1000 / (back + 9.5), rel=0.05)
    assert stage.far_mm >= 1000
    assert any("mirror-imaged" in note for note in made.notes)
    name, _ = find_bundle(str(tmp_path / "balls.pov"))
    assert name == tmp_path.name


def test_the_ini_of_an_animation_gives_the_clock_and_the_folders(tmp_path: Path) -> None:
    """The folder is one that other programs use too, with a name outside ASCII and a pipe in it."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "place.inc").write_text("#declare Turn = 36 * clock;")
    os.mkfifo(tmp_path / "pipe")
    text = '#include "place.inc"\n' + BALLS.replace("90 * clock", "Turn")
    file = tmp_path / "Gr\N{LATIN SMALL LETTER U WITH DIAERESIS}n (2).pov"
    file.write_text(text)
    (tmp_path / "run.ini").write_text(
        "Input_File_Name=GR\xdcN (2).pov\nFinal_Frame=60\nFinal_Clock=10\n+Lparts\n", "utf-8"
    )
    made = init_scene(file)
    scene = check_bundle(find_bundle(str(file))[1]).card
    assert (scene.file, scene.include, scene.stage.follow_camera) == (file.name, ("parts",), True)
    assert (scene.clock.last, scene.clock.frames, scene.clock.cyclic) == (10.0, 60, False)
    assert "# Library_Path of run.ini" in made.text


@pytest.mark.parametrize("name", ['a"b.pov', os.fsdecode(b"a\xff.pov")])
def test_a_scene_whose_name_no_scene_toml_can_have_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(BALLS)
    with pytest.raises(BadInput, match="expected a file with a name of printable letters"):
        init_scene(tmp_path / name)


@pytest.mark.parametrize(
    ("camera", "width"),
    [
        ("orthographic location <0, 0, -10> right 4 * x up 3 * y look_at 0", 4.0),
        ("orthographic angle 45 right -x * 4/3 location <0, 0, -10> look_at 0", 20 * np.tan(np.radians(22.5))),
    ],
)
def test_a_rig_sees_the_width_that_an_orthographic_camera_sees(tmp_path: Path, camera: str, width: float) -> None:
    wall = "box { <-99, -99, 3.9>, <99, 99, 5> pigment { rgb 1 } }"
    (tmp_path / "plan.pov").write_text(f"#version 3.7; camera {{ {camera} }} {wall}")
    stage = parse_scene(tomllib.loads(init_scene(tmp_path / "plan.pov").file.read_text())).stage
    # The wall is at 3.9.
    assert 3.9 - stage.location[2] == pytest.approx(width / 2 / 0.15, rel=0.01)


def test_a_rig_that_would_stand_below_the_ground_is_pointed_out(tmp_path: Path) -> None:
    text = BALLS.replace("location <0, 0, -10>", "location <0, -1, -10>") + "plane { y, -2 pigment { rgb 0.5 } }"
    (tmp_path / "low.pov").write_text(text.replace("look_at 0", "look_at <0, 2, 0>"))
    made = init_scene(tmp_path / "low.pov")
    assert "# CHECK: an object" in made.text
    assert any("in the way of the rig" in note for note in made.notes)


def test_a_scene_toml_is_not_overwritten_and_a_capture_without_one_says_how_to_get_it(tmp_path: Path) -> None:
    (tmp_path / "balls.pov").write_text(BALLS)
    with pytest.raises(BadInput, match=r"lippmann scenes init .*balls\.pov"):
        find_bundle(str(tmp_path / "balls.pov"))
    (tmp_path / "scene.toml").write_text('file = "other.pov"\n')
    with pytest.raises(BadInput, match=r"expected a folder without scene\.toml"):
        init_scene(tmp_path / "balls.pov")
    with pytest.raises(BadInput, match=r"one of fish, .* \(did you mean fish\?\), got 'fihs'"):
        find_bundle("fihs")
    with pytest.raises(BadInput, match=r"expected balls\.pov as `file` of .*got 'other\.pov'"):
        find_bundle(str(tmp_path / "balls.pov"))


def test_a_scene_without_a_camera_is_named(tmp_path: Path) -> None:
    (tmp_path / "parts.inc").write_text("sphere { 0, 1 }")
    with pytest.raises(BadInput, match="expected a scene with a camera"):
        init_scene(tmp_path / "parts.inc")


def test_a_scene_that_fails_later_is_quoted(tmp_path: Path) -> None:
    (tmp_path / "late.pov").write_text(BALLS + '#if (clock > 0.2) #error "this scene ends at clock 0.2" #end')
    with pytest.raises(SceneError, match=r"this scene ends at clock 0\.2"):
        init_scene(tmp_path / "late.pov")


def test_a_scene_of_a_size_that_no_rig_has_gets_no_scene_toml(tmp_path: Path) -> None:
    (tmp_path / "small.pov").write_text("camera { location -1e-5*z look_at 0 } sphere { 0, 1e-6 pigment { rgb 1 } }")
    with pytest.raises(BadInput, match=r"small\.pov"):
        init_scene(tmp_path / "small.pov")
    assert not (tmp_path / "scene.toml").exists()
