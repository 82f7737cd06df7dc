"""Write the scene.toml of a model, .glb or .gltf, by its own camera or by its bounding box.

Nothing of the file is decoded but its JSON and its keys: the bounds of accessors give the box, so no sandbox is needed.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput, InvalidText, LippmannError
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import parse_scene
from lippmann.job.spec import parse_spec
from lippmann.untrusted.gltf_file import Document, GltfFile, read_gltf
from worker.engines.mitsuba.inside.scenes.gltf_accessors import GltfArrays
from worker.engines.mitsuba.inside.scenes.gltf_nodes import Matrix, world_matrices
from worker.engines.mitsuba.inside.scenes.loaded import MAX_FILE_BYTES, SceneFiles

MODEL_SUFFIXES = (".glb", ".gltf")
FRAMES_PER_S = 30
"""The frames of a second of an animation."""
ROOM = 1.1
"""The width that the rig sees, in widths of the model."""
_NEAREST_SHARE = 0.05
"""The least share of the distance to the middle at which the near plane is, for a camera among the objects."""
_TIMES = 9
"""The times of an animation at which the box is taken."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class ModelStage:
    """The place of a rig before a model, in the units of the model."""

    location: Vector
    look_at: Vector
    up: Vector
    near: float
    far: float
    reason: str


def model_text(file: Path, *, tangent: float, near_mm: float, deepest: float) -> tuple[str, tuple[str, ...]]:
    """Return the scene.toml of a model, and notes.

    Parameters
    ----------
    file
        The .glb or .gltf.
    tangent
        The tangent of half the angle of view of the rig.
    near_mm
        The distance from the rig at which the model begins, mm.
    deepest
        The largest ratio of the far depth to the near one.

    Raises
    ------
    BadInput
        If the file is damaged or has no meshes with bounds.
    """
    try:
        if file.stat().st_size > MAX_FILE_BYTES:
            raise BadInput(f"expected a file of at most {MAX_FILE_BYTES:,} bytes, got {file.name} of more")
        gltf = read_gltf(file.read_bytes(), field=file.name)
        length = animation_length(gltf.document)
        job = _placeholder(file.name)
        times = np.linspace(0.0, length, _TIMES if length else 1)
        moved = [GltfArrays(gltf, SceneFiles(file.parent.resolve(), job, float(time))) for time in times]
        matrices = [world_matrices(arrays) for arrays in moved]
        corners = np.concatenate([_corners(gltf, file.name, found) for found in matrices])
        stage = _camera_stage(gltf.document, matrices[0], corners, tangent) or _box_stage(corners, tangent)
    except InvalidText as error:
        raise BadInput(error.message) from error
    except OSError as error:
        raise BadInput(f"expected a file that can be read, got {file}: {error.strerror}") from error
    except LippmannError as error:
        raise BadInput(error.message) from error
    text = _text(file.name, stage, length, near_mm=near_mm, deepest=deepest)
    notes = [stage.reason]
    if gltf.document.skins:
        notes.append("the box of a mesh with a skin is that before its joints move it")
    return text, tuple(notes)


def animation_length(document: Document) -> float:
    """Return the time of the last key of the first animation, s; 0 without one."""
    if not document.animations:
        return 0.0
    inputs = [sampler.input for sampler in document.animations[0].samplers]
    ends = [document.accessors[number].max for number in inputs if number < len(document.accessors)]
    return max((end[0] for end in ends if len(end) == 1 and end[0] > 0), default=0.0)


def _placeholder(name: str) -> ResolvedJob:
    stage = {"location": [0, 0, 1], "look_at": [0, 0, 0], "near_mm": 1, "far_mm": 1}
    return ResolvedJob.of(
        "init", parse_spec({"scene": "scene"}), parse_scene({"file": name, "stage": stage}), bundle="-"
    )


def _corners(gltf: GltfFile, name: str, matrices: dict[int, Matrix]) -> NDArray[np.float64]:
    """Return the corners of the boxes of all meshes in the scene, shape (corner, 3)."""
    document = gltf.document
    found = []
    for index, matrix in matrices.items():
        node = document.nodes[index]
        if node.mesh is None or node.mesh >= len(document.meshes):
            continue
        for primitive in document.meshes[node.mesh].primitives:
            number = primitive.attributes.get("POSITION", len(document.accessors))
            if number >= len(document.accessors):
                continue
            bounds = (document.accessors[number].min, document.accessors[number].max)
            if any(len(bound) != 3 for bound in bounds):
                raise BadInput(f"{name}: accessors.{number}: expected min and max of three numbers, got others")
            box = np.array(list(itertools.product(*zip(*bounds, strict=True))), dtype=np.float64)
            found.append(box @ matrix[:3, :3].T + matrix[:3, 3])
    if not found:
        raise BadInput(f"expected a scene with meshes, got none in {name}")
    return np.concatenate(found)


def _camera_stage(
    document: Document, matrices: dict[int, Matrix], corners: NDArray[np.float64], tangent: float
) -> ModelStage | None:
    """Return the stage of a rig that sees what the first perspective camera sees, from farther away."""
    for index, matrix in matrices.items():
        camera = document.nodes[index].camera
        lens = document.cameras[camera].perspective if camera is not None and camera < len(document.cameras) else None
        if lens is None:
            continue
        ahead, up = -matrix[:3, 2] / np.linalg.norm(matrix[:3, 2]), matrix[:3, 1] / np.linalg.norm(matrix[:3, 1])
        place = matrix[:3, 3]
        depths = (corners - place) @ ahead
        middle = float(np.median(depths))
        if middle <= 0:
            continue
        half = math.tan(lens.yfov / 2) * max(1.0, lens.aspectRatio or 1.0)
        back = (max(1.0, half / tangent) - 1.0) * middle
        near = max(float(depths.min()) + back, _NEAREST_SHARE * (middle + back))
        reason = f"the rig sees what the camera of node {index} sees, from {1 + back / middle:.3g} times as far away"
        location = place - back * ahead
        return ModelStage(
            _vector(location), _vector(place + middle * ahead), _vector(up), near, float(depths.max()) + back, reason
        )
    return None


def _box_stage(corners: NDArray[np.float64], tangent: float) -> ModelStage:
    """Return the stage of a rig in front of the box, on its side of +z, to which models of glTF turn their front."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, half = (low + high) / 2, (high - low) / 2
    size = float(max(half[0], half[1], 1e-6 * max(1.0, float(np.abs(corners).max()))))
    depth = float(half[2])
    # The front of the box is the widest part of what the rig sees.
    near = ROOM * size / tangent
    location = middle + np.array([0.0, 0.0, depth + near])
    reason = (
        "there is no camera: the rig looks along -z at the box of the model, which fills nine tenths of the picture"
    )
    return ModelStage(_vector(location), _vector(middle), (0.0, 1.0, 0.0), near, near + 2 * depth, reason)


def _text(name: str, stage: ModelStage, length: float, *, near_mm: float, deepest: float) -> str:
    mm_per_unit = near_mm / stage.near
    far_mm = max(near_mm, math.ceil(min(stage.far, deepest * stage.near) * mm_per_unit / 50) * 50.0)
    lines = [
        f'file = "{name}"',
        "",
        "[stage]",
        f"# {stage.reason[0].upper()}{stage.reason[1:]}.",
        f"location = {_shown(stage.location)}",
        f"look_at = {_shown(stage.look_at)}",
        f"up = {_shown(stage.up)}",
        f"# The model begins {near_mm:g} mm from the rig. A unit of glTF is a metre: this is a scale of "
        f"{mm_per_unit / 1000:.3g} : 1.",
        f"mm_per_unit = {mm_per_unit:.6g}",
        f"near_mm = {near_mm:.1f}",
        f"far_mm = {far_mm:.1f}",
        'handedness = "right"',
    ]
    if length > 0:
        frames = max(2, round(length * FRAMES_PER_S) + 1)
        lines += [
            "",
            f"# The clock is the time of the animation in seconds, which lasts {length:.4g} s.",
            f'# A job of all frames has "frames": "1-{frames}".',
            "[clock]",
            "first = 0.0",
            f"last = {float(length)!r}",
            f"frames = {frames}",
        ]
    return "\n".join(lines) + "\n"


def _vector(values: NDArray[np.float64]) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _shown(vector: Vector) -> str:
    return f"[{', '.join(repr(float(f'{share:.6g}') + 0.0) for share in vector)}]"
