"""Rays as a POV-Ray camera: a mesh whose face k gives pixel k its start (the centroid) and direction (the normal).

Its cost is the parsing, so a face is written as four numbers. All faces share one vertex, the apex. The second vertex
lies on the rail, a line along the axis, and only its height is written; the third one follows from the start and the
direction of the ray. The coordinates of the mesh are (x + z, y + z, z), so that a point of the rail is (s, s, s), which
POV-Ray reads from the bare number s. Coordinates are whole positive numbers of equal width: a sign is another token to
parse, and NumPy formats such numbers fast. POV-Ray stores vertices as 32-bit floats; therefore faces are large, six
times the radius of the bundle, and rounding turns no ray by more than about 1e-6.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import RenderFailed
from lippmann.optics.lens.trace import Rays
from povtemplates import literals
from worker.engines.engine import Region

FIRST_ROW = 1
"""The row of the picture that shows the first row of rays. For row r of a mesh camera, POV-Ray 3.7 takes the faces
of row r - 1, and for row 0 those of row 0 again; columns and other cameras are not shifted (measured)."""

FIGURES = 7
"""The largest code of a coordinate: 32-bit floats represent whole numbers up to 16,777,216."""

FACES_AT_ONCE = 100_000
"""Whose numbers are written together: a tile of any size needs little memory."""

ROOM = 0.25
"""The margin on each side, as a share of the span of the outermost rays, for inner rays that go farther."""

LEAST_RADIUS_MM = 1.0
"""The least radius of a bundle: a single ray has no width."""

BLIND_UNITS = 0.01
"""Radius of the ball that dead pixels see from inside, in units of the scene: POV-Ray overlooks what is nearer than
1e-4."""

Array = NDArray[np.float64]
Ball = tuple[float, float, float, float]
"""Middle x, y, z, and radius."""


@dataclass(frozen=True)
class Scaffold:
    """The part of the mesh that all tiles of a picture share, so that a pixel has the same face in any tile."""

    apex_mm: Array
    foot_mm: Array
    """The place of the rail, (x, y)."""
    low_mm: float
    """The least coordinate of the mesh's own frame: code 0."""
    step_mm: float
    """The distance between two codes."""
    blind_mm: Ball
    """The z at which the rays of dead pixels start, behind all others."""


def ray_camera_region(*, rows: int, cols: int) -> Region:
    """Return where rows x cols rays are in a picture of `FIRST_ROW` rows more; only these are to be rendered."""
    return Region(FIRST_ROW, rows + FIRST_ROW, 0, cols)


def ray_camera_text(bands: Iterable[Rays], count: int, scaffold: Scaffold) -> Iterator[bytes]:
    """Yield an include file that declares rays as the mesh `Lippmann_Rays`, piece by piece.

    With dead rays it also declares `Lippmann_Blind`, the black object that they see and that must stand in the scene.

    Parameters
    ----------
    bands
        The rays of all pixels of a tile, (row, col, 3), some rows at a time; rig frame, NaN where one is dead. See
        `ray_camera_region`.
    count
        The number of all rays.
    scaffold
        The scaffold of the whole picture.

    Raises
    ------
    RenderFailed
        If a ray lies outside what the scaffold was made for.
    """
    some_dead = False
    yield f"// {count} rays in the rig frame. Written by Lippmann.\n".encode()
    # k times this is <0, 2 k, 2 k - 1> when POV-Ray has cut off the fraction: the vertices of face k.
    yield f"#local F = <0, 2, {2 - 0.5 / count!r}>;\n".encode()
    yield b"#declare Lippmann_Rays = mesh2 {\n"
    yield f"vertex_vectors {{ {2 * count + 1}, {literals.vector(_apex_codes(scaffold))}\n".encode()
    for band in bands:
        codes, dead = face_codes(band, scaffold)
        some_dead |= dead
        yield _text(codes, FIGURES, before=("", "<", " ", " "), end=">\n")
    yield f"}}\nface_indices {{ {count},\n".encode()
    for start in range(1, count + 1, FACES_AT_ONCE):
        numbers = np.arange(start, min(start + FACES_AT_ONCE, count + 1))
        yield _text(numbers[:, np.newaxis], len(str(count)), before=("F*",), end="\n")
    # No ray meets this mesh, so it needs no bounding boxes.
    yield b"}\nhierarchy off\n"
    origin_mm = (*scaffold.foot_mm.tolist(), scaffold.low_mm)
    yield f"matrix <1, 0, 0, 0, 1, 0, -1, -1, 1, 0, 0, 0> scale {literals.number(scaffold.step_mm)} ".encode()
    yield f"translate {literals.vector(origin_mm)}\n}};\n".encode()
    if some_dead:
        yield _blind(scaffold.blind_mm)


def scaffold(outer: Rays, *, front_mm: float, mm_per_unit: float) -> Scaffold:
    """Return what the faces of a picture share.

    Parameters
    ----------
    outer
        Rays (..., 3) about as far apart and as steep as any of the picture; NaN where one is dead.
    front_mm
        The z before which no ray starts. Starts lie behind it by no more than the bundle's width times its slopes.
    mm_per_unit
        The scale of the stage.
    """
    start, direction = _components(outer.at_z(front_mm)), _components(outer.direction)
    alive = ~np.isnan(start).any(axis=0)
    start, direction = start[:, alive], direction[:, alive]
    middle, radius = _footprint(start[:2])
    apex = np.array([middle[0] + 3 * radius, middle[1] - 2 * radius, front_mm])
    foot = np.array([middle[0] - 3 * radius, middle[1] - 2 * radius])
    _advance_points(start, direction, apex @ direction - np.einsum("ir,ir->r", direction, start))
    # Moving the apex along the axis by a moves the starts by a times the square of the direction's z.
    lift = float(np.max((front_mm - start[2]) / direction[2] ** 2, initial=0.0)) * (1 + ROOM)
    apex[2] += lift
    _advance_points(start, direction, lift * direction[2])
    deep = float(np.max(start[2], initial=front_mm) - front_mm) * (1 + ROOM)
    blind_radius_mm = max(BLIND_UNITS * mm_per_unit, 1e-3 * radius)
    blind = np.array([*middle, front_mm + deep + 2 * blind_radius_mm])
    start = np.concatenate((start, blind[:, np.newaxis]), axis=1)
    direction = np.concatenate((direction, _square_to(blind - apex)[:, np.newaxis]), axis=1)
    height, third = _vertices(start, direction, apex, foot)
    low = min(height.min(), third.min(), _sheared_apex(apex, foot).min())
    high = max(height.max(), third.max(), _sheared_apex(apex, foot).max())
    room = ROOM * (high - low)
    return Scaffold(
        apex_mm=apex,
        foot_mm=foot,
        low_mm=float(low - room),
        step_mm=float(high - low + 2 * room) / (10**FIGURES - 1),
        blind_mm=(*blind.tolist(), blind_radius_mm),
    )


def starts_mm(rays: Rays, scaffold: Scaffold) -> Array:
    """Return where POV-Ray has rays (..., 3) start: each moved along itself to the plane that goes through the apex."""
    along = np.sum((scaffold.apex_mm - rays.position) * rays.direction, axis=-1)
    started: Array = rays.position + along[..., np.newaxis] * rays.direction
    return started


def face_codes(rays: Rays, scaffold: Scaffold) -> tuple[NDArray[np.int32], bool]:
    """Return the faces of rays, and whether some are dead.

    The plane of a face is perpendicular to its ray and goes through the apex: this determines where the ray starts and
    where the plane meets the rail. Seen along the axis, the apex A and the rail's foot O lie at two corners in front of
    the bundle, so that the third vertex 3 C - A - O is far from both for every start C.

    Returns
    -------
    NDArray
        (face, 4): height of the second vertex, then the third vertex; steps from `low_mm`, mesh coordinates.
    """
    apex, blind = scaffold.apex_mm, np.array(scaffold.blind_mm[:3])
    start, direction = _components(rays.position), _components(rays.direction)
    dead = np.isnan(start).any(axis=0) | np.isnan(direction).any(axis=0)
    _advance_points(start, direction, apex @ direction - np.einsum("ir,ir->r", direction, start))
    start[:, dead], direction[:, dead] = blind[:, np.newaxis], _square_to(blind - apex)[:, np.newaxis]
    height, third = _vertices(start, direction, apex, scaffold.foot_mm)
    codes = np.stack([_coded(height, scaffold), *(_coded(row, scaffold) for row in third)], axis=-1)
    if codes.min() < 0 or codes.max() >= 10**FIGURES:
        raise RenderFailed("A ray of this tile lies outside what the picture's outermost rays span.")
    return codes, bool(dead.any())


def _vertices(start: Array, direction: Array, apex: Array, foot: Array) -> tuple[Array, Array]:
    """Return the heights of the second vertices and the third ones (3, ray), in mesh coordinates; uses `start` up."""
    height = apex[2] - (foot[0] - apex[0]) * direction[0] / direction[2]
    third = start
    third *= 3
    third -= apex[:, np.newaxis]
    third[:2] -= 2 * foot[:, np.newaxis]  # once for the second vertex, and once to differ from the rail
    third[2] -= height
    third[:2] += third[2]
    return height, third


def _sheared_apex(apex: Array, foot: Array) -> Array:
    return np.array([apex[0] - foot[0] + apex[2], apex[1] - foot[1] + apex[2], apex[2]])


def _apex_codes(scaffold: Scaffold) -> NDArray[np.int32]:
    return _coded(_sheared_apex(scaffold.apex_mm, scaffold.foot_mm), scaffold)


def _coded(coordinates: Array, scaffold: Scaffold) -> NDArray[np.int32]:
    codes: NDArray[np.int32] = np.rint((coordinates - scaffold.low_mm) / scaffold.step_mm).astype(np.int32)
    return codes


def _components(vectors: Array) -> Array:
    """Return vectors (..., 3) as rows x, y, z, shape (3, ray): NumPy is several times faster along them."""
    return np.ascontiguousarray(vectors.reshape(-1, 3).T)


def _advance_points(points: Array, direction: Array, distance: Array) -> None:
    """Move points (3, ray) along their rays, in place: a large tile has millions of them."""
    for coordinate, slope in zip(points, direction, strict=True):
        coordinate += distance * slope


def _footprint(points: Array) -> tuple[Array, float]:
    """Return the middle of points (2, ray) and half the side of a square around them, with room for moved starts."""
    if points.shape[1] == 0:
        return np.zeros(2), LEAST_RADIUS_MM
    low, high = points.min(axis=1), points.max(axis=1)
    return (low + high) / 2, max(1.5 * float(np.max(high - low)) / 2, LEAST_RADIUS_MM)


def _square_to(vector: Array) -> Array:
    """Return the direction nearest to -z at a right angle to a vector."""
    along = vector / np.linalg.norm(vector)
    across = along[2] * along - np.array([0.0, 0.0, 1.0])
    direction: Array = across / np.linalg.norm(across)
    return direction


def _blind(ball: Ball) -> bytes:
    shape = f"{literals.vector(ball[:3])}, {literals.number(ball[3])}"
    black = "texture { Lippmann_Black } Lippmann_Invisible_To_The_Scene()"
    return f"#declare Lippmann_Blind = sphere {{ {shape} {black} }};\n".encode()


def _text(numbers: NDArray[np.integer], figures: int, *, before: tuple[str, ...], end: str) -> bytes:
    """Return rows of whole numbers (row, number) as text, every number at full width behind its word."""
    text = np.empty((len(numbers), sum(map(len, before)) + len(before) * figures + len(end)), np.uint8)
    at = 0
    for column, word in zip(numbers.T, before, strict=True):
        text[:, at : at + len(word)] = np.frombuffer(word.encode(), np.uint8)
        at += len(word) + figures
        rest = column.astype(np.int32)
        for place in range(at - 1, at - 1 - figures, -1):
            tens = rest // 10
            text[:, place] = rest - 10 * tens + ord("0")
            rest = tens
    text[:, at:] = np.frombuffer(end.encode(), np.uint8)
    return text.tobytes()
