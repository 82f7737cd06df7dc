"""The meshes of glTF nodes, in scene coordinates, as shapes of Mitsuba."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mitsuba
import numpy as np
from numpy.typing import NDArray

from lippmann.untrusted.gltf_file import Node, Primitive, Skin
from worker.engines.mitsuba.inside.scenes.gltf_accessors import GltfArrays
from worker.engines.mitsuba.inside.scenes.gltf_materials import GltfMaterials
from worker.engines.mitsuba.inside.scenes.gltf_nodes import Matrix

mi: Any = mitsuba
"""Without types, because those of the stubs are not those of a variant."""

_STRIP, _FAN, _TRIANGLES = 5, 6, 4
MAX_TARGETS = 1000
_USED = frozenset({"POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0", "TANGENT", "JOINTS_0", "WEIGHTS_0"})


@dataclass(frozen=True)
class MeshArrays:
    """The arrays of a mesh, in scene coordinates."""

    positions: NDArray[np.float64]
    """Shape (vertex, 3)."""
    faces: NDArray[np.int64]
    """Shape (face, 3)."""
    normals: NDArray[np.float64] | None = None
    """Shape (vertex, 3)."""
    coordinates: NDArray[np.float64] | None = None
    """Texture coordinates with v downward, shape (vertex, 2)."""
    colours: NDArray[np.float64] | None = None
    """Linear RGB, shape (vertex, 3)."""


def shape_of(name: str, mesh: MeshArrays, *, bsdf: Any, emitter: Any = None) -> Any:
    """Return the shape of a mesh."""
    properties = mi.Properties()
    properties["mesh_bsdf"] = bsdf
    if emitter is not None:
        properties["mesh_emitter"] = emitter
    shape = mi.Mesh(
        name,
        len(mesh.positions),
        len(mesh.faces),
        has_vertex_normals=mesh.normals is not None,
        has_vertex_texcoords=mesh.coordinates is not None,
        props=properties,
    )
    parameters = mi.traverse(shape)
    parameters["vertex_positions"] = mesh.positions.astype(np.float32).ravel()
    parameters["faces"] = mesh.faces.astype(np.uint32).ravel()
    if mesh.normals is not None:
        parameters["vertex_normals"] = mesh.normals.astype(np.float32).ravel()
    if mesh.coordinates is not None:
        parameters["vertex_texcoords"] = mesh.coordinates.astype(np.float32).ravel()
    if mesh.colours is not None:
        shape.add_attribute("vertex_color", 3, mesh.colours.astype(np.float32).ravel())
    parameters.update()
    return shape


def node_shapes(
    index: int,
    arrays: GltfArrays,
    materials: GltfMaterials,
    matrices: dict[int, Matrix],
    weights: Mapping[int, NDArray[np.float64]],
) -> dict[str, Any]:
    """Return the shapes of the mesh of a node, one for each primitive of triangles.

    Parameters
    ----------
    index
        The number of the node.
    arrays, materials
        Those of the file.
    matrices
        The matrices of all nodes; see `world_matrices`.
    weights
        The weights of morph targets that an animation moves, by node.
    """
    files = arrays.files
    node: Node = arrays.document.nodes[index]
    if node.mesh is None:
        return {}
    mesh = arrays.item("meshes", node.mesh, f"{files.name}: nodes.{index}.mesh")
    bones = None if node.skin is None else _bones(node.skin, arrays, matrices, f"{files.name}: nodes.{index}.skin")
    morph = [float(weight) for weight in weights.get(index, node.weights or mesh.weights)]
    shapes = {}
    for number, primitive in enumerate(mesh.primitives):
        place = f"{files.name}: meshes.{node.mesh}.primitives.{number}"
        if primitive.mode < _TRIANGLES:
            files.note(f"{place} is of points or lines (mode {primitive.mode}), which are left out")
            continue
        found = _mesh(primitive, arrays, materials, place, matrix=matrices[index], bones=bones, morph=morph)
        surface = materials.surface(primitive.material, has_colours=found.colours is not None)
        name = f"node{index}_part{number}"
        files.names[name] = f"{node.name or mesh.name or f'node {index}'}" + (f", part {number}" if number else "")
        shapes[name] = shape_of(name, found, bsdf=surface.bsdf, emitter=surface.emitter)
    return shapes


def faces_of_nodes(arrays: GltfArrays, nodes: list[int]) -> tuple[int, int]:
    """Return the numbers of shapes and of faces that nodes have together, before any of them is read."""
    shapes = faces = 0
    for index in nodes:
        mesh = arrays.document.nodes[index].mesh
        if mesh is None:
            continue
        for primitive in arrays.item("meshes", mesh, f"{arrays.files.name}: nodes.{index}.mesh").primitives:
            place = f"{arrays.files.name}: meshes.{mesh}"
            counted = primitive.indices if primitive.indices is not None else primitive.attributes.get("POSITION")
            if counted is not None:
                shapes += 1
                count = arrays.item("accessors", counted, place).count
                faces += count // 3 if primitive.mode == _TRIANGLES else count
    return shapes, faces


def _mesh(
    primitive: Primitive,
    arrays: GltfArrays,
    materials: GltfMaterials,
    place: str,
    *,
    matrix: Matrix,
    bones: NDArray[np.float64] | None,
    morph: Sequence[float],
) -> MeshArrays:
    files = arrays.files
    if "POSITION" not in primitive.attributes:
        raise files.refuse(f"{place}.attributes", "POSITION", ", ".join(primitive.attributes) or "none")
    for name in sorted({*primitive.attributes, *primitive.extensions} - _USED):
        files.note(f"{place}: {name[:80]} is left out")

    def read(name: str, *types: str) -> NDArray[Any] | None:
        number = primitive.attributes.get(name)
        if number is None:
            return None
        values = arrays.accessor(number, f"{place}.attributes.{name}", types=types)
        if name != "POSITION" and len(values) != len(positions):
            raise files.refuse(f"{place}.attributes.{name}", f"{len(positions)} values as of POSITION", len(values))
        return values

    positions = arrays.accessor(primitive.attributes["POSITION"], f"{place}.attributes.POSITION", types=("VEC3",))
    normals, coordinates = read("NORMAL", "VEC3"), read("TEXCOORD_0", "VEC2")
    if primitive.targets:
        positions = _morphed(positions, "POSITION", primitive, arrays, place, weights=morph)
        normals = None if normals is None else _morphed(normals, "NORMAL", primitive, arrays, place, weights=morph)
    colours, joints, weights = read("COLOR_0", "VEC3", "VEC4"), read("JOINTS_0", "VEC4"), read("WEIGHTS_0", "VEC4")
    if bones is not None and joints is not None and weights is not None:
        if (joints < 0).any() or (joints >= len(bones)).any():
            raise files.refuse(f"{place}.attributes.JOINTS_0", f"0 to {len(bones) - 1}", int(joints.max()))
        each = np.einsum("vj,vjab->vab", weights.astype(np.float64), bones[joints.astype(np.int64)])
    else:
        each = matrix[np.newaxis]
    positions = (each[:, :3, :3] @ positions[..., np.newaxis].astype(np.float64))[..., 0] + each[:, :3, 3]
    if normals is not None:
        normals = _turned(each, normals)
    faces = _faces(primitive, arrays, place, vertices=len(positions))
    if bones is None and np.linalg.det(matrix[:3, :3]) < 0:
        faces = faces[:, ::-1]
    if colours is not None and materials.has_colour_texture(primitive.material):
        files.note(f"{place}: the colours of the vertices are left out, because the material has a texture")
        colours = None
    elif colours is not None:
        colours = np.clip(colours[:, :3] * materials.factor(primitive.material), 0.0, 1.0)
    if not np.isfinite(positions).all() or np.abs(positions).max() > 1e15:
        raise files.refuse(f"{place}.attributes.POSITION", "places that are finite in the scene", "others")
    return MeshArrays(positions, faces, normals, coordinates, colours)


def _morphed(
    values: NDArray[Any],
    name: str,
    primitive: Primitive,
    arrays: GltfArrays,
    place: str,
    *,
    weights: Sequence[float],
) -> NDArray[Any]:
    """Return an attribute of vertices, (vertex, 3), with the weighted differences of the morph targets added."""
    if len(weights) not in (0, len(primitive.targets)) or len(primitive.targets) > MAX_TARGETS:
        expected = f"at most {MAX_TARGETS} morph targets, with a weight of each or none"
        raise arrays.files.refuse(f"{place}.targets", expected, f"{len(primitive.targets)} with {len(weights)}")
    moved = values.astype(np.float64)
    for number, (weight, target) in enumerate(zip(weights, primitive.targets, strict=False)):
        if weight == 0 or name not in target:
            continue
        where = f"{place}.targets.{number}.{name}"
        differences = arrays.accessor(target[name], where, types=("VEC3",))
        if len(differences) != len(values):
            raise arrays.files.refuse(where, f"{len(values)} values as of POSITION", len(differences))
        moved += weight * differences
    return moved


def _turned(each: NDArray[np.float64], normals: NDArray[Any]) -> NDArray[np.float64]:
    """Return normals turned as surfaces are, by the cofactors of the matrices, shape (vertex, 3)."""
    rows = each[:, :3, :3]
    cofactors = np.stack(
        [np.cross(rows[:, 1], rows[:, 2]), np.cross(rows[:, 2], rows[:, 0]), np.cross(rows[:, 0], rows[:, 1])], axis=1
    )
    turned = (cofactors @ normals[..., np.newaxis].astype(np.float64))[..., 0]
    turned *= np.sign(np.linalg.det(rows))[:, np.newaxis]
    return np.asarray(turned / np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-300))


def _faces(primitive: Primitive, arrays: GltfArrays, place: str, *, vertices: int) -> NDArray[np.int64]:
    if primitive.indices is None:
        order = np.arange(vertices)
    else:
        order = arrays.accessor(primitive.indices, f"{place}.indices", types=("SCALAR",))[:, 0].astype(np.int64)
        if order.max() >= vertices or order.min() < 0:
            raise arrays.files.refuse(f"{place}.indices", f"vertices from 0 to {vertices - 1}", int(order.max()))
    if primitive.mode == _TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if len(order) < 3:
        return np.empty((0, 3), dtype=np.int64)
    if primitive.mode == _FAN:
        return np.stack([np.full(len(order) - 2, order[0]), order[1:-1], order[2:]], axis=1)
    faces = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
    faces[1::2] = faces[1::2, ::-1]
    return faces


def _bones(index: int, arrays: GltfArrays, matrices: dict[int, Matrix], place: str) -> NDArray[np.float64]:
    """Return the matrix of each joint of a skin from the mesh to the scene, shape (joint, 4, 4)."""
    skin: Skin = arrays.item("skins", index, place)
    lost = [joint for joint in skin.joints if joint not in matrices]
    if lost or not skin.joints:
        raise arrays.files.refuse(f"{place}.joints", "nodes of the scene", lost or "none")
    joints = np.stack([matrices[joint] for joint in skin.joints])
    if skin.inverseBindMatrices is None:
        return joints
    bind = arrays.accessor(skin.inverseBindMatrices, f"{place}.inverseBindMatrices", types=("MAT4",))
    if len(bind) < len(joints):
        raise arrays.files.refuse(f"{place}.inverseBindMatrices", f"{len(joints)} matrices", len(bind))
    return np.asarray(joints @ bind[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1))
