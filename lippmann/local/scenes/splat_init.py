"""Write the scene.toml of Gaussian splats by the box of most of them; a trained file says nothing of its cameras.

The reader is that of the engine; it checks the header and every number before the box is taken.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput, LippmannError
from worker.engines.mitsuba.inside.scenes.splat_file import Splats, read_splats

SHARE_PERCENT = (5.0, 95.0)
"""The percentiles of the centres between which the box lies; floaters and the sky are outside."""
ROOM = 1.1
"""The width that the rig sees, in widths of the box."""
_SOLID = 0.3
"""The opacity from which splats count, if any has it."""


def splat_text(file: Path, *, tangent: float, near_mm: float, deepest: float) -> tuple[str, tuple[str, ...]]:
    """Return the scene.toml of a .ply of splats, and notes.

    Parameters
    ----------
    file
        The .ply.
    tangent
        The tangent of half the angle of view of the rig.
    near_mm
        The distance from the rig at which the box begins, mm.
    deepest
        The largest ratio of the far depth to the near one.

    Raises
    ------
    BadInput
        If the file is no splats or beyond a limit.
    """
    try:
        splats = read_splats(file)
    except LippmannError as error:
        raise BadInput(error.message) from error
    low, high = splat_box(splats)
    middle, half = (low + high) / 2, (high - low) / 2
    size = float(max(half[0], half[1], 1e-6 * max(1.0, float(np.abs(middle).max()))))
    near = ROOM * size / tangent
    location = middle - np.array([0.0, 0.0, half[2] + near])
    scale = near_mm / near
    far_mm = max(near_mm, math.ceil(min(near + 2 * float(half[2]), deepest * near) * scale / 50) * 50.0)
    lines = [
        f'file = "{file.name}"',
        "",
        "[stage]",
        f"# The rig looks along +z, as the cameras of training do, at the box of 90 % of the {len(splats):,} splats.",
        "# CHECK: a file of splats does not say from where its pictures were taken. Turn location round look_at.",
        f"location = {_shown(location)}",
        f"look_at = {_shown(middle)}",
        "# Splats have y downwards.",
        "up = [0.0, -1.0, 0.0]",
        f"# The box begins {near_mm:g} mm from the rig.",
        f"mm_per_unit = {scale:.6g}",
        f"near_mm = {near_mm:.1f}",
        f"far_mm = {far_mm:.1f}",
        'handedness = "right"',
    ]
    return "\n".join(lines) + "\n", ("CHECK location: the rig looks along +z at the box of 90 % of the splats",)


def splat_box(splats: Splats) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest and highest corner of the box of most splats, (3,) each, in units of the scene."""
    solid = splats.opacities >= _SOLID
    centers = splats.centers[solid if solid.any() else slice(None)].astype(np.float64)
    low, high = np.percentile(centers, SHARE_PERCENT, axis=0)
    return low, high


def _shown(vector: NDArray[np.float64]) -> str:
    return f"[{', '.join(repr(float(f'{share:.6g}') + 0.0) for share in vector)}]"
