"""The matrix from the rig frame to the scene."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.job.scenes.stage import Stage
from lippmann.optics.rig.to_scene import rig_to_scene

OBLIQUE = Stage(location=(1, -2, 3), look_at=(4, 2, -1), up=(0.3, 1, 0.2), mm_per_unit=12.5, near_mm=50.0, far_mm=900.0)


def test_the_origin_lands_on_the_location_and_the_axis_passes_through_look_at() -> None:
    matrix = rig_to_scene(OBLIQUE)
    distance_mm = 12.5 * np.linalg.norm(np.subtract(OBLIQUE.look_at, OBLIQUE.location))
    assert matrix @ [0, 0, 0, 1] == pytest.approx([1, -2, 3, 1])
    assert matrix @ [0, 0, -distance_mm, 1] == pytest.approx([4, 2, -1, 1])


@pytest.mark.parametrize(("handedness", "mirrored"), [("left", -1), ("right", 1)])
def test_a_picture_is_no_mirror_image_in_axes_of_either_hand(handedness: str, mirrored: int) -> None:
    """The rig frame is right-handed, so the matrix to left-handed axes mirrors."""
    placed = rig_to_scene(OBLIQUE.model_copy(update={"handedness": handedness}))[:3, :3] * 12.5
    assert np.linalg.det(placed) == pytest.approx(mirrored)
    assert placed.T @ placed == pytest.approx(np.eye(3))
    assert placed[:, 1] @ OBLIQUE.up > 0


def test_auto_means_what_the_caller_says() -> None:
    right = rig_to_scene(OBLIQUE.model_copy(update={"handedness": "right"}))
    assert np.array_equal(rig_to_scene(OBLIQUE, auto="right"), right)
    assert not np.array_equal(rig_to_scene(OBLIQUE), right)
