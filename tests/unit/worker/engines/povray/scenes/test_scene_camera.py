"""The codes of a report are read as the camera that made them, whatever it is, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from worker.engines.povray.scenes.scene_camera import COLS, ROWS, read_location, read_vectors

TOP, HALF, STEP, SLOPE = 65535, 2.0**21, 8192, 4.0
X, Y = np.meshgrid((np.arange(COLS) + 0.5) / COLS - 0.5, 0.5 - (np.arange(ROWS) + 0.5) / ROWS)


def codes(shares: NDArray[np.float64]) -> NDArray[np.uint16]:
    return np.rint(shares * TOP).astype(np.uint16)


def shown_vectors(
    right: NDArray[np.float64], up: NDArray[np.float64], ahead: NDArray[np.float64]
) -> NDArray[np.uint16]:
    """Return the codes of a box around a camera: the place where the ray of each pixel meets it."""
    ray = ahead + X[..., np.newaxis] * right + Y[..., np.newaxis] * up
    return codes(0.5 + ray / np.abs(ray).max(axis=-1, keepdims=True) / 2.5)


def shown_location(place: NDArray[np.float64]) -> NDArray[np.uint16]:
    """Return the codes of the walls around a camera that looks along z."""
    ray = np.stack([SLOPE * X, SLOPE * Y, np.ones_like(X)], axis=-1)
    with np.errstate(divide="ignore"):
        reach = (np.sign(ray) * HALF - place) / ray
    axis = reach.argmin(axis=-1)
    point = place + ray * reach.min(axis=-1, keepdims=True)
    wall = np.choose(axis, [np.where(X > 0, 1, 2), np.where(Y > 0, 3, 4), 0])
    shown = np.take_along_axis(point, np.choose(axis, [1, 2, 0])[..., np.newaxis], axis=-1)[..., 0]
    part = (shown / HALF + 1) / 2
    return codes(np.stack([part, part * STEP % 1, (wall + 0.25 + part * STEP**2 % 1 / 2) / 8], axis=-1))


@pytest.mark.parametrize("seed", range(20))
def test_vectors_of_any_camera_are_read(seed: int) -> None:
    random = np.random.default_rng(seed)
    right, up, ahead = (random.normal(size=3) * scale for scale in (1.3, 1.0, 2.0))
    found = read_vectors(shown_vectors(right, up, ahead))
    assert found is not None
    length = np.linalg.norm(ahead)
    for vector, expected in ((found.right, right), (found.up, up), (found.direction, ahead)):
        assert vector == pytest.approx(expected / length, abs=1e-4)


@pytest.mark.parametrize("size", [0.0, 0.01, 3.0, 1e3, 1e6])
def test_a_location_of_any_size_is_read_to_some_millionths_of_a_unit(size: float) -> None:
    place = size * np.array([0.3, -0.9, 0.7])
    found = read_location(shown_location(place), scale=1.0)
    assert found == pytest.approx(place, abs=5e-6)


def test_a_far_location_is_read_at_its_scale() -> None:
    found = read_location(shown_location(np.array([10.0, 20.0, -5.0])), scale=2.0**-20)
    assert found == pytest.approx(np.array([10.0, 20.0, -5.0]) * 2**20, abs=4)


@pytest.mark.parametrize("seen", ["black", "white", "noise"])
def test_a_picture_that_is_no_report_is_no_camera(seen: str) -> None:
    random = np.random.default_rng(1)
    picture = {
        "black": np.zeros((ROWS, COLS, 3)),
        "white": np.ones((ROWS, COLS, 3)),
        "noise": random.random((ROWS, COLS, 3)),
    }[seen]
    assert read_vectors(codes(picture)) is None
    assert read_location(codes(picture), scale=1.0) is None


def test_a_camera_outside_the_box_is_none() -> None:
    assert read_location(shown_location(np.array([0.95 * HALF, 0, 0])), scale=1.0) is None
