"""The materials of glTF as BSDFs and lights of Mitsuba: metallic-roughness becomes `principled`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import mitsuba
import numpy as np
from numpy.typing import NDArray

from lippmann.untrusted.gltf_file import Material, Sampler, TextureInfo
from worker.engines.mitsuba.inside.scenes.gltf_accessors import GltfArrays
from worker.engines.mitsuba.inside.scenes.loaded import SceneFiles
from worker.engines.mitsuba.inside.scenes.pictures import colour_texture, count_pixels, data_texture, read_picture

mi: Any = mitsuba
"""Without types, because those of the stubs are not those of a variant."""

_WRAPS = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
_NEAREST = 9728
_KNOWN = {
    "KHR_materials_emissive_strength",
    "KHR_materials_transmission",
    "KHR_materials_ior",
    "KHR_materials_clearcoat",
}

Codes = NDArray[np.uint8]
"""The pixels of a picture, shape (row, col, 4), 8 bit RGBA."""


@dataclass(frozen=True)
class Surface:
    """The material of a mesh, as Mitsuba has it."""

    bsdf: Any
    emitter: Any
    """The light that the surface gives; None if it gives none."""


class GltfMaterials:
    """The materials of one file, each made once."""

    def __init__(self, arrays: GltfArrays) -> None:
        self._arrays = arrays
        self._made: dict[tuple[int | None, bool], Any] = {}
        self._pictures: dict[int, Codes] = {}
        self._textures: dict[tuple[int | str | float, ...], Any] = {}

    def surface(self, index: int | None, *, has_colours: bool) -> Surface:
        """Return the BSDF of a material, and a light of its own for a mesh.

        Parameters
        ----------
        index
            The number of the material; None for the default of the format.
        has_colours
            True if the mesh has colours at its vertices, already multiplied by the factor of the material.
        """
        place = f"{self._arrays.files.name}: materials.{index}"
        material = Material() if index is None else self._arrays.item("materials", index, place)
        key = (index, has_colours)
        if key not in self._made:
            self._made[key] = mi.load_dict(self._bsdf(material, place, has_colours=has_colours))
        emitted = self._emitted(material, place)
        return Surface(self._made[key], mi.load_dict(emitted) if emitted else None)

    def factor(self, index: int | None) -> tuple[float, float, float]:
        """Return the factor of a material's base colour, linear RGB."""
        if index is None:
            return (1.0, 1.0, 1.0)
        material = self._arrays.item("materials", index, f"{self._arrays.files.name}: materials.{index}")
        red, green, blue, _ = material.pbrMetallicRoughness.baseColorFactor
        return red, green, blue

    def has_colour_texture(self, index: int | None) -> bool:
        """Return whether a material takes its base colour from a texture."""
        if index is None:
            return False
        material = self._arrays.item("materials", index, f"{self._arrays.files.name}: materials.{index}")
        return material.pbrMetallicRoughness.baseColorTexture is not None

    def _bsdf(self, material: Material, place: str, *, has_colours: bool) -> dict[str, Any]:
        self._note_dropped(material, place)
        rough, extensions = material.pbrMetallicRoughness, material.extensions
        bsdf: dict[str, Any] = {"type": "principled"}
        factor = rough.baseColorFactor[:3]
        opacity: Any = rough.baseColorFactor[3]
        if rough.baseColorTexture is not None:
            info, where = rough.baseColorTexture, f"{place}.baseColorTexture"
            bsdf["base_color"] = self._texture(
                info, where, f"colour {factor}", lambda codes: colour_texture(codes, factor)
            )
            if material.alphaMode != "OPAQUE":
                least = material.alphaCutoff if material.alphaMode == "MASK" else None
                kind = f"opacity {opacity} {least}"
                opacity = self._texture(info, where, kind, partial(_opacities, factor=float(opacity), least=least))
        elif has_colours:
            bsdf["base_color"] = {"type": "mesh_attribute", "name": "vertex_color"}
        else:
            bsdf["base_color"] = {"type": "rgb", "value": [min(1.0, max(0.0, share)) for share in factor]}
        bsdf["roughness"], bsdf["metallic"] = rough.roughnessFactor, rough.metallicFactor
        if rough.metallicRoughnessTexture is not None:
            info, where = rough.metallicRoughnessTexture, f"{place}.metallicRoughnessTexture"
            for name, channel, most in (("roughness", 1, rough.roughnessFactor), ("metallic", 2, rough.metallicFactor)):
                bsdf[name] = self._texture(
                    info, where, f"{name} {most}", partial(_channel, channel=channel, factor=most)
                )
        transmission = self._number(extensions, "KHR_materials_transmission", "transmissionFactor", 0.0, place)
        if transmission > 0:
            bsdf["spec_trans"] = min(1.0, transmission)
            bsdf["eta"] = max(1.01, self._number(extensions, "KHR_materials_ior", "ior", 1.5, place))
        clearcoat = self._number(extensions, "KHR_materials_clearcoat", "clearcoatFactor", 0.0, place)
        if clearcoat > 0:
            bsdf["clearcoat"] = min(1.0, clearcoat)
        if material.normalTexture is not None:
            bsdf = self._with_normals(bsdf, material.normalTexture, f"{place}.normalTexture")
        if transmission <= 0:
            bsdf = {"type": "twosided", "inside": bsdf}
        if material.alphaMode == "OPAQUE":
            return bsdf
        if material.alphaMode == "MASK" and isinstance(opacity, float):
            opacity = float(opacity >= material.alphaCutoff)
        return {"type": "mask", "opacity": opacity, "inside": bsdf}

    def _with_normals(self, bsdf: dict[str, Any], info: TextureInfo, place: str) -> dict[str, Any]:
        turns = texture_matrix(info, self._arrays.files, place)[:2, :2]
        if turns[0, 1] or turns[1, 0] or (np.diag(turns) < 0).any():
            self._arrays.files.note(f"{place} turns its texture; the bumps themselves are not turned")
        texture = self._texture(info, place, f"normal {info.scale}", partial(_normals, scale=info.scale))
        return {"type": "normalmap", "normalmap": texture, "inside": bsdf}

    def _emitted(self, material: Material, place: str) -> dict[str, Any] | None:
        strength = self._number(
            material.extensions, "KHR_materials_emissive_strength", "emissiveStrength", 1.0, place
        ) * self._arrays.files.value("light_scale", 1.0)
        red, green, blue = (max(0.0, share * strength) for share in material.emissiveFactor)
        if max(red, green, blue) <= 0:
            return None
        if material.emissiveTexture is None:
            return {"type": "area", "radiance": {"type": "rgb", "value": [red, green, blue]}}
        factor = (red, green, blue)
        texture = self._texture(
            material.emissiveTexture,
            f"{place}.emissiveTexture",
            f"colour {factor}",
            lambda codes: colour_texture(codes, factor),
        )
        return {"type": "area", "radiance": texture}

    def _texture(self, info: TextureInfo, place: str, kind: str, convert: Callable[[Codes], dict[str, Any]]) -> Any:
        """Return a texture of Mitsuba, made once for all materials that use a picture in the same way."""
        matrix = texture_matrix(info, self._arrays.files, place)
        key: tuple[int | str | float, ...] = (info.index, kind, *map(float, matrix.ravel()))
        if key not in self._textures:
            codes, settings = self._picture(info, place)
            settings |= {} if np.array_equal(matrix, np.eye(3)) else {"to_uv": mi.ScalarTransform3f(matrix)}
            count_pixels(codes.shape[1], codes.shape[0], self._arrays.files, place=place)
            self._textures[key] = mi.load_dict(convert(codes) | settings)
        return self._textures[key]

    def _picture(self, info: TextureInfo, place: str) -> tuple[Codes, dict[str, Any]]:
        """Return the pixels of a texture, and how Mitsuba is to sample them."""
        arrays, files = self._arrays, self._arrays.files
        texture = arrays.item("textures", info.index, place)
        where = f"{files.name}: textures.{info.index}"
        moved = info.extensions.get("KHR_texture_transform")
        if (moved.get("texCoord", info.texCoord) if isinstance(moved, dict) else info.texCoord) != 0:
            files.note(f"{place} has texture coordinates of its own; TEXCOORD_0 stands in for them")
        source = texture.extensions.get("EXT_texture_webp", {}).get("source", texture.source)
        if not isinstance(source, int) or source < 0:
            raise files.refuse(f"{where}.source", "a picture: PNG, JPEG or WebP", "none")
        if source not in self._pictures:
            picture = arrays.item("images", source, f"{where}.source")
            named = f"{files.name}: images.{source}"
            if picture.uri is not None:
                data = arrays.file_or_data(picture.uri, f"{named}.uri")
            elif picture.bufferView is not None:
                data = arrays.bytes_of_view(picture.bufferView, f"{named}.bufferView")
            else:
                raise files.refuse(named, "a uri or a bufferView", "neither")
            # Pixels are counted for each texture that is made of them.
            self._pictures[source] = read_picture(data, replace(files, texture_px=0), place=named)
        sampler = Sampler()
        if texture.sampler is not None:
            sampler = arrays.item("samplers", texture.sampler, f"{where}.sampler")
        if sampler.wrapS != sampler.wrapT:
            files.note(f"{where} repeats differently along its axes; both are {_WRAPS[sampler.wrapS]!r}")
        settings = {
            "wrap_mode": _WRAPS[sampler.wrapS],
            "filter_type": "nearest" if sampler.magFilter == _NEAREST else "bilinear",
        }
        return self._pictures[source], settings

    def _number(self, extensions: dict[str, Any], name: str, key: str, default: float, place: str) -> float:
        extension = extensions.get(name)
        if extension is None:
            return default
        given = extension.get(key, default) if isinstance(extension, dict) else extension
        if isinstance(given, bool) or not isinstance(given, int | float) or not 0 <= given <= 1e9:
            raise self._arrays.files.refuse(f"{place}.extensions.{name}.{key}", "a number from 0 to 1e9", repr(given))
        return float(given)

    def _note_dropped(self, material: Material, place: str) -> None:
        note = self._arrays.files.note
        if material.occlusionTexture is not None:
            note(f"{place}: the occlusion texture is left out, because rays find what is hidden")
        if material.alphaMode == "BLEND":
            note(f"{place}: alphaMode BLEND is the opacity of a mask")
        for name in sorted(set(material.extensions) - _KNOWN):
            note(f"{place}: {name[:80]} is left out")


def texture_matrix(info: TextureInfo, files: SceneFiles, place: str) -> NDArray[np.float64]:
    """Return the matrix, (3, 3), that takes the coordinates of a mesh to those of a texture (KHR_texture_transform).

    The coordinates are scaled, then turned counter-clockwise as the picture is seen, with v downward, then moved.

    Raises
    ------
    SceneError
        If the extension is no offset, rotation and scale of numbers up to 1e6.
    """
    given = info.extensions.get("KHR_texture_transform", {})
    given = given if isinstance(given, dict) else {}
    where = f"{place}.extensions.KHR_texture_transform"
    across, down = _numbers(given, "offset", [0.0, 0.0], files, where)
    wide, high = _numbers(given, "scale", [1.0, 1.0], files, where)
    (angle,) = _numbers({"rotation": [given.get("rotation", 0.0)]}, "rotation", [0.0], files, where)
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine * wide, sine * high, across], [-sine * wide, cosine * high, down], [0.0, 0.0, 1.0]])


def _numbers(given: dict[str, Any], name: str, default: list[float], files: SceneFiles, place: str) -> list[float]:
    found = given.get(name, default)
    is_list = isinstance(found, list) and len(found) == len(default)
    if not is_list or not all(type(one) in (int, float) and abs(one) <= 1e6 for one in found):
        raise files.refuse(f"{place}.{name}", f"{len(default)} numbers up to 1e6", repr(found))
    return [float(one) for one in found]


def _channel(codes: Codes, *, channel: int, factor: float) -> dict[str, Any]:
    return data_texture(codes[..., channel] / 255.0 * factor)


def _opacities(codes: Codes, *, factor: float, least: float | None) -> dict[str, Any]:
    alpha = codes[..., 3] / 255.0 * factor
    return data_texture(alpha if least is None else (alpha >= least).astype(np.float64))


def _normals(codes: Codes, *, scale: float) -> dict[str, Any]:
    return data_texture(0.5 + (codes[..., :3] / 255.0 - 0.5) * (scale, scale, 1.0))
