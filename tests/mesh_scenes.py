"""Scenes of triangles that POV-Ray and Mitsuba show alike: the same meshes, colours and lights, in the words of either.

Lights are parallel, because a light of POV-Ray does not fade and one of Mitsuba does. POV-Ray shows a surface as
reflectance times cosine times light, and Mitsuba divides by pi, so that a light of Mitsuba is pi times as strong.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from worker.sandbox.bundle import pack_folder

Array = NDArray[np.float64]
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Mesh:
    """A diffuse mesh."""

    vertices: Array
    """(vertex, 3), in units of the scene."""
    normals: Array
    """(vertex, 3)."""
    faces: NDArray[np.int64]
    """(face, 3), the numbers of vertices."""
    colour: Vector
    """Linear reflectance."""


@dataclass(frozen=True)
class Light:
    """A parallel light."""

    direction: Vector
    """The direction in which it shines."""
    colour: Vector
    """The radiance of a white surface that faces it."""


def mesh2(mesh: Mesh) -> str:
    """Return the SDL of a mesh without its textures: `mesh2 {` up to its last list."""
    lists = [("vertex_vectors", mesh.vertices), ("normal_vectors", mesh.normals), ("face_indices", mesh.faces)]
    return "mesh2 { " + "\n".join(f"{word} {{ {len(rows)}, {vectors(rows)} }}" for word, rows in lists)


def vectors(rows: NDArray[np.generic]) -> str:
    """Return rows of numbers as vectors of SDL."""
    return ", ".join(f"<{', '.join(map(repr, row))}>" for row in rows.tolist())


def ply(mesh: Mesh) -> bytes:
    """Return the mesh as a binary PLY with normals."""
    names = "".join(f"property float {word}\n" for word in ("x", "y", "z", "nx", "ny", "nz"))
    corners = np.empty(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    corners["count"], corners["corners"] = 3, mesh.faces
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.vertices)}\n{names}"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return head.encode() + np.hstack([mesh.vertices, mesh.normals]).astype("<f4").tobytes() + corners.tobytes()


def povray_bundle(folder: Path, meshes: Iterable[Mesh], lights: Iterable[Light], *, stage: str) -> bytes:
    """Write the scene for POV-Ray into a new folder, on right-handed axes; return its bundle.

    `stage` holds the lines of the stage.
    """
    folder.mkdir()
    lines = ["#version 3.7;", "global_settings { assumed_gamma 1 }"]
    for mesh in meshes:
        pigment = f"pigment {{ rgb <{', '.join(map(repr, mesh.colour))}> }}"
        lines.append(f"{mesh2(mesh)} {pigment} finish {{ ambient 0 diffuse 1 }} }}")
    for light in lights:
        far = ", ".join(repr(-1e5 * part) for part in light.direction)
        colour = ", ".join(map(repr, light.colour))
        lines.append(f"light_source {{ <{far}> color rgb <{colour}> parallel point_at 0 }}")
    (folder / "scene.inc").write_text("\n".join(lines))
    (folder / "scene.toml").write_text(f'[stage]\nhandedness = "right"\n{stage}\n')
    return pack_folder(folder)


def write_for_mitsuba(folder: Path, meshes: Sequence[Mesh], lights: Iterable[Light]) -> None:
    """Write the scene for Mitsuba into a new folder, as scene.xml and its meshes."""
    folder.mkdir()
    lines = ['<scene version="3.0.0">']
    for number, mesh in enumerate(meshes):
        (folder / f"{number}.ply").write_bytes(ply(mesh))
        lines.append(
            f'<shape type="ply"><string name="filename" value="{number}.ply"/><bsdf type="twosided"><bsdf '
            f'type="diffuse"><rgb name="reflectance" value="{words(mesh.colour)}"/></bsdf></bsdf></shape>'
        )
    for light in lights:
        lines.append(
            f'<emitter type="directional"><vector name="direction" value="{words(light.direction)}"/>'
            f'<rgb name="irradiance" value="{words([math.pi * part for part in light.colour])}"/></emitter>'
        )
    (folder / "scene.xml").write_text("\n".join([*lines, "</scene>"]))


def words(numbers: Iterable[float]) -> str:
    return " ".join(map(repr, numbers))


def flat(corners: Array, colour: Vector) -> Mesh:
    """Return a mesh of plane triangles (face, 3, 3)."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = across / np.linalg.norm(across, axis=1, keepdims=True)
    return Mesh(
        corners.reshape(-1, 3), np.repeat(normals, 3, axis=0), np.arange(3 * len(corners)).reshape(-1, 3), colour
    )


def torus(*, rings: int, sides: int, radius: float, tube: float, colour: Vector, turn: Array, at: Vector) -> Mesh:
    """Return a torus of plane triangles."""
    a, b = np.meshgrid(*(2 * np.pi * np.arange(count + 1) / count for count in (rings, sides)), indexing="ij")
    away = radius + tube * np.cos(b)
    points = np.stack([away * np.cos(a), away * np.sin(a), tube * np.sin(b)], axis=-1) @ turn.T + at
    p, q, r, s = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    corners = np.stack([np.stack([p, q, r], axis=-2), np.stack([p, r, s], axis=-2)])
    return flat(corners.reshape(-1, 3, 3), colour)


def quad(corner: Vector, first: Vector, second: Vector, colour: Vector) -> Mesh:
    """Return a parallelogram of two triangles."""
    p, u, v = (np.array(part, float) for part in (corner, first, second))
    return flat(np.array([[p, p + u, p + u + v], [p, p + u + v, p + v]]), colour)
