"""The camera of a scene, as POV-Ray itself reports it in two small pictures.

The scene is rendered with its own camera, which is moved to a place far from its objects (see camera_report.pov.j2):
once to the centre of a box whose colours are directions, and once with a known direction into a box whose colours are
places. The text of the scene is not parsed here, so it does not matter how the scene makes its camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene_camera import SceneCamera
from povtemplates import literals, write
from worker.engines.povray.scene import FAR, parameter_literals

COLS, ROWS = 32, 24
"""The size of a report, px: the aspect ratio is 4:3, as that of POV-Ray's default picture."""
QUALITY = 8
"""Neither radiosity, nor photons, nor media."""

TOP = 65535
_CODE_SPAN = 2.5
_STEP = 8192
_HALF = 2.0**21
_SLOPE = 4.0
_REACH = 0.9
"""The share of the box in which places are measured."""
SCALES = (1.0, 2.0**-20)
"""The scales of the scene in which its camera is searched: up to 1.9 million units from the origin, and beyond."""

WIDTH_SCALES = (1.0, 2.0**7, 2.0**14, 2.0**21)
_LEAST_WIDTH, _GREATEST_WIDTH = 0.003, 0.5

_LARGEST_ERROR = 1e-3
"""The largest root-mean-square error of the fitted directions, as a share of the distance; codes give 1e-5."""
_LARGEST_ERROR_UNITS = 0.01
"""The largest root-mean-square error of the fitted place in the box; codes give 3e-6."""


@dataclass(frozen=True)
class Vectors:
    """The vectors of a camera, up to a common factor: |direction| is 1."""

    direction: NDArray[np.float64]
    right: NDArray[np.float64]
    up: NDArray[np.float64]


def report_text(sheet: ResolvedJob, what: Literal["vectors", "width", "location"], *, scale: float = 1.0) -> str:
    """Return the .pov text of a report at a frame: see `ResolvedJob.at`.

    Parameters
    ----------
    what
        The vectors of the camera, the width of what a camera of parallel rays sees, or the location of the camera.
    scale
        The scale of the scene in which the location or the width is reported, one of `SCALES` or `WIDTH_SCALES`.
    """
    return write.write_camera_report(
        title=f"Scene {sheet.spec.scene}",
        file=literals.file_name(sheet.file.rpartition("/")[2]),
        as_itself=sheet.file.lower().endswith(".pov"),
        parameters=parameter_literals(sheet),
        distances=None,
        vectors=what in ("vectors", "width"),
        width=what == "width",
        code_span=_CODE_SPAN,
        step=_STEP,
        half=int(_HALF),
        slope=_SLOPE,
        scale=repr(scale),
    )


def distances_text(
    sheet: ResolvedJob, *, near: float, amplitude: float = 1.0, camera: SceneCamera | None = None
) -> str:
    """Return the .pov text of a picture of the distances that a camera sees, by means of fog: see lippmann/depth.inc.

    Parameters
    ----------
    near
        The scale of near distances, scene units.
    amplitude
        The brightness of the fog.
    camera
        The perspective camera; None for that of the scene, of any kind.
    """
    vectors = {} if camera is None else camera.model_dump()
    kind = "" if camera is None else "perspective "
    return write.write_camera_report(
        title=f"Scene {sheet.spec.scene}",
        file=literals.file_name(sheet.file.rpartition("/")[2]),
        as_itself=sheet.file.lower().endswith(".pov"),
        parameters=parameter_literals(sheet),
        distances={
            "amplitude": literals.number(amplitude),
            "near": literals.number(near),
            "far": literals.number(FAR * near),
            "camera": kind + " ".join(f"{name} {literals.vector(vector)}" for name, vector in vectors.items()),
        },
    )


def along_axis(distances: NDArray[np.float64], camera: SceneCamera) -> NDArray[np.float64]:
    """Return depths along the axis of a camera from distances along its rays, both `(row, col)`."""
    x, y = _pixel_places(1.0)
    ray = np.stack([x, y, np.ones_like(x)], axis=-1) @ np.array([camera.right, camera.up, camera.direction])
    cosine = ray @ np.array(camera.axes()[2]) / np.linalg.norm(ray, axis=-1)
    depths: NDArray[np.float64] = distances * cosine.reshape(distances.shape)
    return depths


def read_vectors(codes: NDArray[np.uint16]) -> Vectors | None:
    """Return the vectors of a camera from the codes of its report, `(row, col, 3)`; None if it shows none.

    The ray of a pixel at (x, y) has the direction `direction + x * right + y * up`, and the colour of the box is a
    point on that ray. Both are parallel, which is linear in the nine unknowns.
    """
    point = (codes.reshape(-1, 3) / TOP - 0.5) * _CODE_SPAN
    size = np.abs(point).max(axis=-1, keepdims=True)
    if not (np.abs(size - 1.0) < _LARGEST_ERROR).all():
        return None
    point = point / np.linalg.norm(point, axis=-1, keepdims=True)
    pixel = np.stack([*_pixel_places(1.0), np.ones(len(point))], axis=-1)
    crossed = np.cross(point[:, np.newaxis, :], np.eye(3)[np.newaxis])
    equations = np.einsum("nji,nk->nikj", crossed, pixel).reshape(-1, 9)
    right, up, direction = np.linalg.svd(equations, full_matrices=False)[2][-1].reshape(3, 3)
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        return None
    right, up, direction = right / length, up / length, direction / length
    ray = pixel @ np.stack([right, up, direction])
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    sign = math.copysign(1.0, float((ray * point).sum()))
    error = float(np.sqrt(np.mean((sign * ray - point) ** 2)))
    return Vectors(sign * direction, sign * right, sign * up) if error < _LARGEST_ERROR else None


def read_width(codes: NDArray[np.uint16], *, scale: float) -> float | None:
    """Return the width of what a camera sees on the wall of a box, from the codes of its report, scene units.

    For a camera of parallel rays it does not depend on the scale. There is no width if the wall shows too little of it
    at this scale, or is not before the camera.
    """
    point = (codes.reshape(ROWS, COLS, 3) / TOP - 0.5) * _CODE_SPAN
    if not (np.abs(np.abs(point).max(axis=-1) - 1.0) < _LARGEST_ERROR).all():
        return None
    width = float(np.linalg.norm((point[:, -1] - point[:, 0]).mean(axis=0)))
    return width * _HALF / scale * COLS / (COLS - 1) if _LEAST_WIDTH < width < _GREATEST_WIDTH else None


def read_location(codes: NDArray[np.uint16], *, scale: float) -> NDArray[np.float64] | None:
    """Return the location of a camera from the codes of its report; None if the camera is not inside the box.

    Each pixel shows one coordinate of the point at which its ray meets a wall, which is linear in the location.
    """
    first, second, third = (codes.reshape(-1, 3) / TOP).T
    # The last step takes a half of its share, so that no rounding reaches the number of another wall.
    wall, third = np.floor(third * 8), ((third * 8) % 1 - 0.25) * 2
    coarse = (np.round(first * _STEP - second) + second) / _STEP
    part = (np.round(coarse * _STEP**2 - third) + third) / _STEP**2
    seen = (2 * part - 1) * _HALF
    x, y = _pixel_places(_SLOPE)
    ones, zeros = np.ones_like(x), np.zeros_like(x)
    side = np.where((wall == 1) | (wall == 3), _HALF, -_HALF)
    rows = (
        (wall == 0, (ones, zeros, -x), seen - x * _HALF),
        ((wall == 1) | (wall == 2), (-y / x, ones, zeros), seen - y / x * side),
        ((wall == 3) | (wall == 4), (zeros, -1 / y, ones), seen - side / y),
    )
    equations = np.concatenate([np.stack(left, axis=-1)[here] for here, left, _ in rows])
    values = np.concatenate([value[here] for here, _, value in rows])
    if len(values) < len(x) or not all(here.any() for here, *_ in rows):
        return None
    location = np.linalg.lstsq(equations, values, rcond=None)[0]
    error = float(np.sqrt(np.mean((equations @ location - values) ** 2)))
    if error > _LARGEST_ERROR_UNITS or np.abs(location).max() > _REACH * _HALF:
        return None
    found: NDArray[np.float64] = location / scale
    return found


def scene_camera(vectors: Vectors, location: NDArray[np.float64]) -> SceneCamera:
    """Return the camera of a scene."""

    def triple(vector: NDArray[np.float64]) -> tuple[float, float, float]:
        x, y, z = map(float, vector)
        return x, y, z

    return SceneCamera(
        location=triple(location),
        direction=triple(vectors.direction),
        right=triple(vectors.right),
        up=triple(vectors.up),
    )


def _pixel_places(slope: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the places (x, y) of the pixels in the picture, -slope / 2 to slope / 2, row by row."""
    x, y = np.meshgrid((np.arange(COLS) + 0.5) / COLS - 0.5, 0.5 - (np.arange(ROWS) + 0.5) / ROWS)
    return slope * x.ravel(), slope * y.ravel()
