"""A rig that follows a camera moves as one body with it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError

from lippmann.job.scenes.scene_camera import SceneCamera, followed_stage
from lippmann.job.scenes.stage import Stage

Vector = tuple[float, float, float]
STAGE = Stage(location=(0, 3, -20), look_at=(0, 1, 0), up=(0, 1, 0), near_mm=900, far_mm=2000)


def camera(location: Vector, direction: Vector, up: Vector = (0, 1, 0), right: Vector = (1.33, 0, 0)) -> SceneCamera:
    return SceneCamera(location=location, direction=direction, right=right, up=up)


FIRST = camera((0, 1, -8), (0, 0, 1))


def test_a_camera_that_stands_leaves_the_rig_where_it_is() -> None:
    there = followed_stage(STAGE, first=FIRST, now=FIRST)
    assert np.array(there.location) == pytest.approx(np.array(STAGE.location))
    assert np.array(there.look_at) == pytest.approx(np.array(STAGE.look_at))


def test_an_orbit_takes_the_rig_around() -> None:
    """A quarter turn about y takes -z to -x, as POV-Ray turns."""
    there = followed_stage(STAGE, first=FIRST, now=camera((-8, 1, 0), (1, 0, 0), right=(0, 0, -1.33)))
    assert np.array(there.location) == pytest.approx(np.array([-20, 3, 0]))
    assert np.array(there.look_at) == pytest.approx(np.array([0, 1, 0]), abs=1e-9)
    assert there.far_mm == STAGE.far_mm


def test_a_camera_that_rolls_rolls_the_rig() -> None:
    there = followed_stage(STAGE, first=FIRST, now=camera((0, 1, -8), (0, 0, 1), up=(1, 0, 0), right=(0, -1.33, 0)))
    assert np.array(there.up) == pytest.approx(np.array([1, 0, 0]))


def test_distances_between_camera_and_rig_stay() -> None:
    now = camera((5, -2, 3), (0.6, 0.2, -1.0), up=(0.1, 1.0, 0.3), right=(-1, 0, 0.5))
    there = followed_stage(STAGE, first=FIRST, now=now)
    assert math.dist(there.location, now.location) == pytest.approx(math.dist(STAGE.location, FIRST.location))
    assert math.dist(there.look_at, there.location) == pytest.approx(math.dist(STAGE.look_at, STAGE.location))


@pytest.mark.parametrize(
    ("direction", "up", "right", "handedness"),
    [
        ((0, 0, 1), (0, 1, 0), (1, 0, 0), "left"),
        ((0, 0, 1), (0, 1, 0), (-1, 0, 0), "right"),
        ((0, 1, 0), (0, 0, 1), (1, 0, 0), "right"),
        ((0, 0, -2), (0, 1, 0), (-3, 0, 0), "left"),
    ],
)
def test_the_handedness_is_that_of_the_three_vectors(
    direction: Vector, up: Vector, right: Vector, handedness: str
) -> None:
    assert camera((0, 0, 0), direction, up, right).handedness == handedness


def test_a_report_of_the_same_camera_is_at_the_same_place() -> None:
    assert FIRST.is_at(camera((1e-6, 1, -8), (1e-6, 0, 1)))
    assert not FIRST.is_at(camera((0.01, 1, -8), (0, 0, 1)))
    assert not FIRST.is_at(camera((0, 1, -8), (0.01, 0, 1)))


def test_vectors_that_span_no_picture_are_refused() -> None:
    with pytest.raises(ValidationError, match="span a plane"):
        camera((0, 0, 0), (0, 1, 0), up=(0, 1, 0))
