"""The place of the rig in its scene: the matrix from the rig frame, mm, to the axes and units of the scene.

It is that of `Lippmann_Stage` in povtemplates/include/lippmann/stage.inc, which places the rig for POV-Ray.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.job.scenes.stage import Stage

Handedness = Literal["left", "right"]


def rig_to_scene(stage: Stage, *, auto: Handedness = "left") -> NDArray[np.float64]:
    """Return the matrix that takes points of the rig frame to the scene, float64 (4, 4).

    It multiplies columns (x, y, z, 1) in mm from the left and gives columns in units of the scene. Its upper left 3 x 3
    part is a rotation, or a rotation and a mirror, times 1 / `mm_per_unit`: x of the rig goes to the observer's right,
    y upward and z away from what the rig looks at. The part has a positive determinant in a scene of right-handed
    axes and a negative one in a scene of left-handed axes, so that a picture is never a mirror image.

    Parameters
    ----------
    stage
        The position of the rig in the scene, and the scale.
    auto
        The handedness of the scene's axes where the stage says `auto`.

    Examples
    --------
    >>> stage = Stage(location=(0, 60, -1000), look_at=(0, 60, 0), mm_per_unit=2.0, near_mm=1000.0, far_mm=1000.0)
    >>> (rig_to_scene(stage) @ [10.0, 0.0, -100.0, 1.0]).tolist()
    [5.0, 60.0, -950.0, 1.0]
    """
    matrix = np.eye(4)
    matrix[:3, :3] = rig_axes(stage, auto=auto) / stage.mm_per_unit
    matrix[:3, 3] = stage.location
    return matrix


def rig_axes(stage: Stage, *, auto: Handedness = "left") -> NDArray[np.float64]:
    """Return the directions x, y, z of the rig frame in the scene as columns, float64 (3, 3), orthonormal.

    Parameters
    ----------
    stage
        The position of the rig in the scene.
    auto
        The handedness of the scene's axes where the stage says `auto`.
    """
    ahead = _unit(np.array(stage.look_at) - np.array(stage.location))
    right = _unit(np.cross(stage.up, ahead))
    upward = np.cross(ahead, right)
    if (auto if stage.handedness == "auto" else stage.handedness) == "right":
        right = -right
    axes = np.empty((3, 3))
    axes[:, 0], axes[:, 1], axes[:, 2] = right, upward, -ahead
    return axes


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    scaled: NDArray[np.float64] = vector / np.linalg.norm(vector)
    return scaled
