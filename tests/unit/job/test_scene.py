"""scene.toml as data, and a job's parameters filled in."""

from __future__ import annotations

from typing import Any

import pytest

from worker.errors import BundleError, SpecError
from worker.job.scene import SceneCard, parse_scene

STAGE = {"location": [0, 0, -1000], "look_at": [0, 0, 0], "reference_mm": 1000, "near_mm": 900, "far_mm": 2000}


def card(**parameters: dict[str, Any]) -> SceneCard:
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
        ({"colour": "red"}, "colour: expected no such field"),
        ({"parameters": {"clock": TURN}}, "that POV-Ray does not keep, got 'clock'"),
        ({"parameters": {"Turn-x": TURN}}, "lower snake case"),
        ({"parameters": {"turn": TURN | {"default": 999}}}, "a default that is number from"),
    ],
)
def test_a_wrong_scene_toml_names_its_field(change: dict[str, Any], message: str) -> None:
    with pytest.raises(BundleError, match=message):
        parse_scene({"title": "A scene", "stage": STAGE} | change)
