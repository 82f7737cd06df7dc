"""Meshes without a scene around them, .obj and .ply: one shape for each object of the file, and a default light."""

from __future__ import annotations

import logging
import re
from dataclasses import replace
from typing import Any, NoReturn

import mitsuba
import numpy as np
import trimesh

from worker.engines.mitsuba.inside.scenes.gltf_meshes import MeshArrays, shape_of
from worker.engines.mitsuba.inside.scenes.loaded import MAX_SHAPES, SceneFiles, default_light
from worker.engines.mitsuba.inside.scenes.mesh_checks import check_mesh_file
from worker.engines.mitsuba.inside.scenes.pictures import LINEAR, check_picture, colour_texture, read_picture

mi: Any = mitsuba
"""Without types, because those of the stubs are not those of a variant."""

_MTLLIB = re.compile(rb"^[ \t]*mtllib[ \t]+([^\r\n]+)", re.MULTILINE)
_MAP = re.compile(rb"^[ \t]*(map_\w+|bump|disp|decal|refl|norm)[ \t]+([^\r\n]+)", re.MULTILINE | re.IGNORECASE)
_MAX_MTL_BYTES = 4 * 1024 * 1024
_GREY = {"type": "twosided", "inside": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.6}}}


class _InsideBundle(trimesh.resolvers.Resolver):
    """What trimesh reads beside the file that it was given, which is inside the bundle whatever the file says."""

    def __init__(self, files: SceneFiles) -> None:
        # The pixels of the pictures are counted once, by _check_materials.
        self._files = replace(files, texture_px=0)

    def get(self, name: str) -> bytes:
        """Return the bytes of a material file or of a picture whose header is of a size that a texture may have."""
        data = self._files.path(name, beside=self._files.name, place=self._files.name).read_bytes()
        if not name.lower().endswith(".mtl"):
            check_picture(data, self._files, place=name)
        return data

    def keys(self) -> list[str]:
        """Return no names: trimesh is to guess none."""
        return []

    def write(self, name: str, data: bytes) -> None:
        """Refuse to write."""
        raise NotImplementedError

    def namespaced(self, namespace: str) -> NoReturn:
        """Refuse other folders."""
        raise NotImplementedError


def load_mesh(files: SceneFiles) -> Any:
    """Return the `mi.Scene` of a .obj or .ply.

    Raises
    ------
    SceneError
        If the file is damaged or beyond a limit, or one that it names is missing or outside the bundle.
    """
    path = files.path(files.name, beside="", place="file")
    for name in sorted(files.job.parameters):
        files.note(f"parameters.{name} reaches nothing in {files.name}")
    check_mesh_file(path, files, name=files.name, place=files.name)
    if path.suffix.lower() == ".obj":
        _check_materials(path.read_bytes(), files)
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)
    try:
        with path.open("rb") as file:
            loaded: Any = trimesh.load_scene(
                file, file_type=path.suffix.lower()[1:], resolver=_InsideBundle(files), process=False
            )
    except Exception as error:  # trimesh has no error of its own: whatever a damaged file does to it.
        raise files.refuse(files.name, "a mesh that is whole", f"{type(error).__name__}: {error}") from error
    scene: dict[str, Any] = {"type": "scene"}
    meshes = {
        name: mesh for name, mesh in loaded.geometry.items() if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)
    }
    found = list(meshes.values())
    if len(found) > MAX_SHAPES:
        raise files.refuse(files.name, f"at most {MAX_SHAPES:,} objects", f"{len(found):,}")
    files.check_faces(sum(len(mesh.faces) for mesh in found))
    for number, (name, mesh) in enumerate(meshes.items()):
        files.names[f"mesh{number}"] = str(name)
        scene[f"mesh{number}"] = _shape(f"mesh{number}", mesh, files)
    if not found:
        raise files.refuse(files.name, "a mesh with faces", "none")
    return mi.load_dict(scene | default_light(files), optimize=False)


def _check_materials(data: bytes, files: SceneFiles) -> None:
    """Check that the material files and textures that an .obj names are in the bundle."""
    for named in _MTLLIB.findall(data)[:100]:
        library = named.decode("utf-8", "replace").strip()
        place = f"{files.name}: mtllib"
        path = files.path(library, beside=files.name, place=place, at_most=_MAX_MTL_BYTES)
        for kind, words in _MAP.findall(path.read_bytes()):
            picture = words.decode("utf-8", "replace").strip().split()[-1]
            where = f"{library}: {kind.decode('ascii', 'replace')}"
            texture = files.path(picture, beside=files.name, place=where)
            read_picture(texture.read_bytes(), files, place=where)
            if kind.lower() != b"map_kd":
                files.note(f"{where} is left out")


def _shape(name: str, mesh: Any, files: SceneFiles) -> Any:
    positions, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    if not np.isfinite(positions).all():
        raise files.refuse(f"{files.name}: {name}", "vertices that are finite", "NaN or infinity")
    if faces.min() < 0 or faces.max() >= len(positions):
        raise files.refuse(f"{files.name}: {name}", f"faces of the {len(positions)} vertices", int(faces.max()))
    visual, bsdf, coordinates, colours = mesh.visual, _GREY, None, None
    if visual.kind == "vertex":
        colours = LINEAR[np.asarray(visual.vertex_colors)[:, :3]]
        bsdf = _diffuse({"type": "mesh_attribute", "name": "vertex_color"})
    elif visual.kind == "texture":
        material, given = visual.material, getattr(visual, "uv", None)
        image, diffuse = getattr(material, "image", None), getattr(material, "diffuse", None)
        if image is not None and given is not None and np.ndim(given) == 2 and np.shape(given)[1] >= 2:
            coordinates = np.stack([given[:, 0], 1.0 - given[:, 1]], axis=1)
            bsdf = _diffuse(colour_texture(np.asarray(image.convert("RGBA")), (1.0, 1.0, 1.0)))
        elif diffuse is not None:
            codes = np.asarray(diffuse, dtype=np.float64)[:3] / 255.0
            bsdf = _diffuse({"type": "rgb", "value": codes.tolist()})
    normals = np.asarray(mesh.vertex_normals) if "vertex_normals" in mesh._cache else None
    # Normals of the file only: those that trimesh computes would round the edges of a box.
    arrays = MeshArrays(positions, faces, normals, coordinates, colours)
    return shape_of(name, arrays, bsdf=mi.load_dict(bsdf))


def _diffuse(colour: dict[str, Any]) -> dict[str, Any]:
    return {"type": "twosided", "inside": {"type": "diffuse", "reflectance": colour}}
