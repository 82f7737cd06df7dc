"""glTF 2.0 scenes, .gltf and .glb, at a time: meshes, materials and lights.

The clock of the job is the time of the animation in seconds. Two parameters of a scene have a meaning of their own:
`animation` is the number of the animation that plays, and `light_scale` multiplies all lights of the file.
"""

from __future__ import annotations

import math
from typing import Any

import mitsuba

from lippmann.errors import InvalidText, SceneError
from lippmann.untrusted.gltf_file import read_gltf
from worker.engines.mitsuba.inside.scenes.gltf_accessors import GltfArrays
from worker.engines.mitsuba.inside.scenes.gltf_materials import GltfMaterials
from worker.engines.mitsuba.inside.scenes.gltf_meshes import faces_of_nodes, node_shapes
from worker.engines.mitsuba.inside.scenes.gltf_nodes import Matrix, morph_weights, world_matrices
from worker.engines.mitsuba.inside.scenes.loaded import MAX_SHAPES, SceneFiles, default_light

mi: Any = mitsuba
"""Without types, because those of the stubs are not those of a variant."""

PARAMETERS = frozenset({"animation", "light_scale"})
_LIGHTS = "KHR_lights_punctual"
_READ = frozenset(
    {
        _LIGHTS,
        "EXT_texture_webp",
        "KHR_materials_clearcoat",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_transmission",
        "KHR_materials_unlit",
        "KHR_mesh_quantization",
        "KHR_texture_transform",
    }
)
"""The extensions that a file may require."""


def load_gltf(files: SceneFiles) -> Any:
    """Return the `mi.Scene` of a glTF file.

    Raises
    ------
    SceneError
        If the file is damaged, beyond a limit, names a file outside the bundle, or requires what is not read.
    """
    path = files.path(files.name, beside="", place="file")
    try:
        file = read_gltf(path.read_bytes(), field=files.name)
    except InvalidText as error:
        raise SceneError(error.message) from error
    for name in file.document.extensionsRequired:
        if name not in _READ:
            raise files.refuse(f"{files.name}: extensionsRequired", f"some of {', '.join(sorted(_READ))}", name)
    for name in sorted(set(files.job.parameters) - PARAMETERS):
        files.note(f"parameters.{name} reaches nothing in {files.name}")
    arrays = GltfArrays(file, files)
    matrices = world_matrices(arrays)
    shapes, faces = faces_of_nodes(arrays, list(matrices))
    if shapes > MAX_SHAPES:
        raise files.refuse(f"{files.name}: nodes", f"at most {MAX_SHAPES:,} meshes", f"{shapes:,}")
    files.check_faces(faces)
    materials, weights = GltfMaterials(arrays), morph_weights(arrays)
    scene: dict[str, Any] = {"type": "scene"}
    for index in matrices:
        scene |= node_shapes(index, arrays, materials, matrices, weights)
    if len(scene) == 1:
        raise files.refuse(f"{files.name}: nodes", "a mesh of triangles in the scene", "none")
    has_light = any(shape.is_emitter() for name, shape in scene.items() if name != "type")
    lights = {f"light{index}": light for index in matrices if (light := _light(index, arrays, matrices[index]))}
    return mi.load_dict(scene | (lights if lights or has_light else default_light(files)), optimize=False)


def _light(index: int, arrays: GltfArrays, matrix: Matrix) -> dict[str, Any] | None:
    """Return the light of a node (KHR_lights_punctual); a lux or candela of the file is a unit of radiance here."""
    files = arrays.files
    held = arrays.document.nodes[index].extensions.get(_LIGHTS)
    if held is None:
        return None
    place = f"{files.name}: nodes.{index}.extensions.{_LIGHTS}.light"
    lights = _table(arrays.document.extensions.get(_LIGHTS)).get("lights")
    number = _table(held).get("light")
    known = lights if isinstance(lights, list) else []
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < len(known):
        raise files.refuse(place, f"one of the {len(known)} lights", repr(number))
    light, where = _table(known[number]), f"{files.name}: extensions.{_LIGHTS}.lights.{number}"
    colour = light.get("color", [1, 1, 1])
    if not isinstance(colour, list) or len(colour) != 3:
        raise files.refuse(f"{where}.color", "three numbers", repr(colour))
    strength = _number(files, f"{where}.intensity", light.get("intensity", 1.0)) * files.value("light_scale", 1.0)
    value = {"type": "rgb", "value": [_number(files, f"{where}.color", share) * strength for share in colour]}
    if "range" in light:
        files.note(f"{where}: range is left out; the light falls with the square of the distance")
    place_of = [float(share) for share in matrix[:3, 3]]
    ahead = [-float(share) for share in matrix[:3, 2]]
    kind = light.get("type")
    if kind == "directional":
        return {"type": "directional", "direction": ahead, "irradiance": value}
    if kind == "point":
        return {"type": "point", "position": place_of, "intensity": value}
    if kind == "spot":
        spot = _table(light.get("spot", {}))
        outer = min(
            _number(files, f"{where}.spot.outerConeAngle", spot.get("outerConeAngle", math.pi / 4)), math.pi / 2
        )
        inner = min(_number(files, f"{where}.spot.innerConeAngle", spot.get("innerConeAngle", 0.0)), outer)
        target = [start + share for start, share in zip(place_of, ahead, strict=True)]
        up = [float(share) for share in matrix[:3, 1]]
        return {
            "type": "spot",
            "to_world": mi.ScalarTransform4f().look_at(origin=place_of, target=target, up=up),
            "intensity": value,
            "cutoff_angle": math.degrees(outer),
            "beam_width": math.degrees(inner),
        }
    raise files.refuse(f"{where}.type", "directional, point or spot", repr(kind))


def _table(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _number(files: SceneFiles, place: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 1e9:
        raise files.refuse(place, "a number from 0 to 1e9", repr(value))
    return float(value)
