"""The place of a rig in its scene, as Python and as the macro of the library compute it."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from lippmann.job.scenes.stage import Stage
from lippmann.optics.rig.to_scene import rig_to_scene
from povtemplates import literals
from tests.integration.povray.sdl import evaluate

POINTS_MM = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (7.0, -30.0, 250.0))


@pytest.mark.parametrize(("handedness", "mirrored"), [("left", "false"), ("right", "true")])
def test_the_matrix_of_a_stage_is_that_of_the_macro(
    handedness: Literal["left", "right"], mirrored: str, tmp_path: Path
) -> None:
    stage = Stage(
        location=(1, -2, 3),
        look_at=(4, 2, -1),
        up=(0.3, 1, 0.2),
        mm_per_unit=12.5,
        near_mm=50.0,
        far_mm=900.0,
        handedness=handedness,
    )
    vectors = ", ".join(literals.vector(vector) for vector in (stage.location, stage.look_at, stage.up))
    placed = f"""#version 3.7;
    #declare Lippmann_Mirrored = {mirrored};
    #include "lippmann/stage.inc"
    #declare Placed = function {{ transform {{ Lippmann_Stage({vectors}, 12.5) }} }};
    """
    axes = [f"Placed({', '.join(map(str, point))}).{axis}" for point in POINTS_MM for axis in "xyz"]
    expected = [(rig_to_scene(stage) @ [*point, 1.0])[:3] for point in POINTS_MM]
    assert evaluate(tmp_path, placed, *axes) == pytest.approx(np.ravel(expected), abs=1e-9)
