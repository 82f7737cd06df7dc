"""scene.toml as data, and a job's parameters filled in."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.errors import BundleError, SpecError
from lippmann.job.scenes.scene import SceneManifest, parse_scene

STAGE = {"location": [0, 0, -1000], "look_at": [0, 0, 0], "reference_mm": 1000, "near_mm": 900, "far_mm": 2000}


def card(**parameters: dict[str, Any]) -> SceneManifest:
    return parse_scene({"title": "A scene", "stage": STAGE, "parameters": parameters})


TURN = {"type": "number", "default": 8.0, "minimum": -180, "maximum": 180}


def test_what_a_job_does_not_set_is_the_default() -> None:
    scene = card(turn=TURN, on={"type": "boolean", "default": True})
    assert scene.resolve({"turn": 3}) == {"turn": 3, "on": True}


def test_an_unknown_parameter_is_refused_with_the_known_ones() -> None:
    with pytest.raises(SpecError, match=r"parameters\.trun: expected one of turn, got unknown parameter 'trun'"):
        card(turn=TURN).resolve({"trun": 3})


@pytest.mark.parametrize(
    ("parameter", "value", "expected"),
    [
        (TURN, 181, "number from -180.0 to 180.0"),
        (TURN, "fast", "a number"),
        (TURN, True, "a number"),
        ({"type": "integer", "default": 1}, 1.5, "an integer"),
        ({"type": "boolean", "default": True}, 1, "true or false"),
        ({"type": "color", "default": "#000000"}, "red", "a colour like"),
    ],
)
def test_a_parameter_out_of_bounds_is_named(parameter: dict[str, Any], value: Any, expected: str) -> None:
    with pytest.raises(SpecError, match=rf"parameters\.p: expected {expected}.* got "):
        card(p=parameter).resolve({"p": value})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stage": STAGE | {"far_mm": 10}}, r"stage: expected near_mm <= far_mm, got 900\.0 and 10\.0"),
        ({"stage": STAGE | {"up": [0, 0, 5]}}, "up that span a plane"),
        ({"stage": STAGE | {"look_at": [0, 0, -1000]}}, "up that span a plane"),
        ({"title": ""}, "title"),
        ({"file": "../woodbox.pov"}, r"file: expected a file inside the bundle .* got '\.\./woodbox\.pov'"),
        ({"file": "a/../../b.pov"}, "file: expected"),
        ({"file": "../fish.glb"}, "file: expected"),
        ({"file": "fish.blend"}, r"file: expected .*\.pov, \.inc, \.xml, \.gltf, \.glb, \.obj, \.ply"),
        ({"file": "fish.glb", "include": ["models"]}, r"include: expected no folders"),
        ({"file": "fish.glb", "stage": STAGE | {"follow_camera": True}}, r"stage\.follow_camera: expected false"),
        ({"file": "/etc/motd.inc"}, "file: expected"),
        ({"file": 'a".pov'}, "file: expected"),
        ({"file": "a.pov\n"}, "file: expected"),
        ({"file": 'two words/b"c/a.pov'}, "file: expected"),
        ({"file": "B\N{LATIN SMALL LETTER O WITH DIAERESIS}den/a.pov"}, "file: expected"),
        ({"file": ".hidden.pov"}, "file: expected"),
        ({"file": "a\\b.pov"}, "file: expected"),
        ({"file": "a\N{RIGHT-TO-LEFT OVERRIDE}b.pov"}, "file: expected"),
        ({"include": ["../models"]}, r"include: expected folders inside the bundle.* got '\.\./models'"),
        ({"include": ["/usr"]}, "include: expected folders"),
        ({"include": ["a/./b"]}, "include: expected folders"),
        ({"include": [""]}, "include: expected folders"),
        ({"include": ["x" * 201]}, "include: expected folders"),
        ({"include": ["a"] * 17}, "include: expected .*16"),
        ({"file": "picture.png"}, "file: expected"),
        ({"stage": STAGE | {"reference_mm": 0}}, r"stage\.reference_mm: expected a number above 0"),
        ({"colour": "red"}, "colour: expected no field of this name"),
        ({"parameters": {"clock": TURN}}, "that POV-Ray does not keep, got 'clock'"),
        ({"parameters": {"Turn-x": TURN}}, "lower snake case"),
        ({"parameters": {"turn": TURN | {"default": 999}}}, "a default that is number from"),
    ],
)
def test_a_wrong_scene_toml_names_its_field(change: dict[str, Any], message: str) -> None:
    with pytest.raises(BundleError, match=message):
        parse_scene({"title": "A scene", "stage": STAGE} | change)


@pytest.mark.parametrize(
    "file",
    [
        "woodbox.pov",
        "scene.xml",
        "models/Fish.GLB",
        "fish.gltf",
        "room.obj",
        "room.ply",
        "scenes-1.2/a.POV",
        "advanced/wood box.pov",
        "shapes.inc",
        "R&D, 2025 [old]/O'Brien's scene (2).pov",
        "W\N{LATIN SMALL LETTER U WITH DIAERESIS}rfel.pov",
    ],
)
def test_a_scene_may_be_any_scene_file_of_the_bundle(file: str) -> None:
    assert parse_scene({"file": file, "stage": STAGE}).file == file


def test_a_scene_toml_that_only_says_where_the_rig_stands_is_enough() -> None:
    stage = {"location": [0, 3, -90], "look_at": [0, 0, 0], "near_mm": 1000, "far_mm": 2000}
    scene = parse_scene({"file": "drums.pov", "stage": stage})
    assert scene.title == "drums.pov"
    assert scene.stage.reference_mm == 1000
    assert scene.stage.mm_per_unit == 1
    assert scene.stage.up == (0, 1, 0)


def test_without_a_file_the_scene_is_scene_inc() -> None:
    assert parse_scene({"stage": STAGE}).file == "scene.inc"


def test_a_wrong_field_is_named_alone() -> None:
    """What would have been taken from it is not complained of as well."""
    with pytest.raises(BundleError) as refused:
        parse_scene({"file": "a.txt", "stage": STAGE})
    assert str(refused.value).count("expected") == 1


@pytest.mark.parametrize("kind", ["number", "integer"])
def test_a_number_that_no_float_holds_is_refused(kind: str) -> None:
    with pytest.raises(SpecError, match=r"parameters\.turn: expected"):
        card(turn={"type": kind, "default": 1}).resolve({"turn": 10**400})
