"""The motion of the points that rays hit, from a frame to the next one, in mm of the rig frame.

A point of a mesh stays between its three vertices, wherever these go: by transforms of nodes, by joints of a skin, or
by other vertices in the file of the next frame. A point of a sphere, a disk and other shapes that are no meshes moves
with the matrix of its shape. So both scenes, that of the frame and that of the next one, are in memory.
"""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.job.scenes.stage import Stage
from lippmann.optics.rig.to_scene import rig_to_scene
from worker.engines.mitsuba.inside.channels import object_numbers
from worker.engines.mitsuba.inside.messages import UnsupportedError

Float32 = NDArray[np.float32]
Points = NDArray[np.float64]


def motion_values(scene: Any, later: Any, sent: tuple[Any, Any], stage: Stage, later_stage: Stage) -> Float32:
    """Return the motion of the points that rays hit, (ray, 3), mm; NaN where they hit nothing.

    Parameters
    ----------
    scene, later
        The scenes at the frame and at the next one.
    sent
        The rays in the units of the scene, and which are alive.
    stage, later_stage
        The stages of both frames: a rig that moves sees what stands still move.

    Raises
    ------
    UnsupportedError
        If the scenes have instances of groups, or their shapes do not correspond.
    """
    ray, alive = sent
    hit = scene.ray_intersect_preliminary(ray, active=alive)
    shapes, later_shapes = _corresponding(scene, later)
    numbers = object_numbers(scene, hit)[:, 0].astype(np.int64) - 1
    place = np.array(ray.o, dtype=np.float64).T + (np.array(hit.t) * np.array(ray.d, dtype=np.float64)).T
    primitives, inside = np.array(hit.prim_index, dtype=np.int64), np.array(hit.prim_uv, dtype=np.float64).T
    moved = np.full((len(numbers), 3), np.nan, dtype=np.float32)
    for number in np.unique(numbers[numbers >= 0]).tolist():
        rays = numbers == number
        name = f"{shapes[number].id()[:60]!r}, object {number + 1},"
        points = _both_places(
            mi.traverse(shapes[number]), mi.traverse(later_shapes[number]), name, place[rays], primitives[rays],
            inside[rays],
        )  # fmt: skip
        here, there = (_in_rig(of_frame, at) for of_frame, at in zip(points, (stage, later_stage), strict=True))
        moved[rays] = there - here
    return moved


def _corresponding(scene: Any, later: Any) -> tuple[list[Any], list[Any]]:
    """Return the shapes of both scenes, which are the same ones in the same order."""
    both = list(scene.shapes()), list(later.shapes())
    for shape in both[0]:
        if shape.class_name() == "Instance":  # of a group, whose shapes are not listed
            raise UnsupportedError(f"The channel motion is not rendered with instances, as {shape.id()[:60]!r} is one.")
    names = [[shape.id() for shape in shapes] for shapes in both]
    if names[0] != names[1]:
        counts = f"{len(names[0])} and {len(names[1])}"
        raise UnsupportedError(f"The channel motion needs the same shapes in the next frame, got {counts}, or others.")
    return both


def _both_places(
    shape: Any, later: Any, name: str, place: Points, primitives: NDArray[np.int64], inside: Points
) -> tuple[Points, Points]:
    """Return the places of points of a shape at a frame and at the next one, (ray, 3) each, scene units.

    Parameters
    ----------
    shape, later
        The parameters of the shape at both frames.
    name
        The shape, for the error.
    place
        The points, (ray, 3), as the rays have found them.
    primitives, inside
        The face of a mesh, (ray,), and the weights of its second and third vertex, (ray, 2).
    """
    if "vertex_positions" in shape:
        faces = np.array(shape["faces"]).reshape(-1, 3)
        if "vertex_positions" not in later or not np.array_equal(faces, np.array(later["faces"]).reshape(-1, 3)):
            raise UnsupportedError(
                f"The channel motion needs the same faces in the next frame: {name} has others there."
            )
        weights = np.column_stack([1 - inside.sum(axis=1), inside])
        return _between(shape, faces[primitives], weights), _between(later, faces[primitives], weights)
    if "to_world" not in shape or "to_world" not in later:
        raise UnsupportedError(f"The channel motion needs meshes or shapes with to_world, got neither in {name}.")
    before, after = (np.array(each["to_world"].matrix, dtype=np.float64).reshape(4, 4) for each in (shape, later))
    if np.array_equal(before, after):
        return place, place
    step = after @ np.linalg.inv(before)
    return place, _mapped(step, place)


def _between(shape: Any, corners: NDArray[np.int64], weights: Points) -> Points:
    """Return the points between the vertices of faces, (ray, 3), by their weights, (ray, 3)."""
    vertices = np.array(shape["vertex_positions"], dtype=np.float64).reshape(-1, 3)
    found: Points = (weights[..., np.newaxis] * vertices[corners]).sum(axis=1)
    return found


def _in_rig(points: Points, stage: Stage) -> Points:
    """Return points of the scene in the rig frame, mm."""
    to_rig = np.linalg.inv(rig_to_scene(stage, auto="right")).astype(np.float64)
    return _mapped(to_rig, points)


def _mapped(matrix: Points, points: Points) -> Points:
    """Return points, (ray, 3), mapped by a matrix, (4, 4); the same bits for a point whatever is beside it."""
    x, y, z = (points[:, axis, np.newaxis] for axis in range(3))
    found: Points = x * matrix[:3, 0] + y * matrix[:3, 1] + z * matrix[:3, 2] + matrix[:3, 3]
    return found
