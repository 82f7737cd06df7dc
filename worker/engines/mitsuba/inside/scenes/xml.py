"""Mitsuba's own XML: every element, plugin, file name and number is checked before Mitsuba sees the text.

Includes and `$names` are resolved here, so that what is checked is what Mitsuba reads. The sensor, integrator, film and
sampler of a file are left out with a note: the rig is the camera, and the job chooses the samples.
"""

from __future__ import annotations

import math
import re
from pathlib import PurePosixPath
from typing import Any
from xml.etree.ElementTree import Element, ParseError, tostring

import mitsuba
import numpy as np
from defusedxml import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from worker.engines.mitsuba.inside.scenes.loaded import MAX_SHAPES, SceneFiles, default_light
from worker.engines.mitsuba.inside.scenes.mesh_checks import check_mesh_file
from worker.engines.mitsuba.inside.scenes.picture_sizes import check_picture_file
from worker.engines.mitsuba.inside.scenes.pictures import LINEAR

mi: Any = mitsuba
"""Without types, because those of the stubs are not those of a variant."""

MAX_XML_BYTES = 16 * 1024 * 1024
MAX_ELEMENTS = 200_000
MAX_DEPTH = 32
MAX_INCLUDE_DEPTH = 8
MAX_INCLUDES = 500
_MAX_NUMBER = 1e15

PLUGINS = {
    "shape": ("cube", "cylinder", "disk", "instance", "obj", "ply", "rectangle", "shapegroup", "sphere"),
    "bsdf": (
        *("blendbsdf", "bumpmap", "conductor", "dielectric", "diffuse", "mask", "normalmap", "null", "plastic"),
        *("principled", "principledthin", "roughconductor", "roughdielectric", "roughplastic", "thindielectric"),
        "twosided",
    ),
    "texture": ("bitmap", "checkerboard", "mesh_attribute"),
    "emitter": ("area", "constant", "directional", "envmap", "point", "spot"),
    "spectrum": ("blackbody", "d65", "irregular", "regular", "srgb", "uniform"),
}
"""The plugins that a scene may use, by element."""
LEFT_OUT = frozenset({"sensor", "integrator", "film", "sampler", "rfilter"})
_VALUES = frozenset({"boolean", "float", "integer", "point", "ref", "rgb", "string", "transform", "vector"})
_STEPS = frozenset({"lookat", "matrix", "rotate", "scale", "translate"})
_TAGS = frozenset({*PLUGINS, *_VALUES, *_STEPS, "default", "include", "scene"})
_NUMBERS = {
    "float": ("value",),
    "integer": ("value",),
    "lookat": ("origin", "target", "up"),
    "matrix": ("value",),
    "point": ("value", "x", "y", "z"),
    "rotate": ("value", "angle", "x", "y", "z"),
    "scale": ("value", "x", "y", "z"),
    "translate": ("value", "x", "y", "z"),
    "vector": ("value", "x", "y", "z"),
}
_NAME = re.compile(r"\$([A-Za-z_]\w*)")
_HEX = re.compile("#[0-9a-fA-F]{6}")
_WORD = re.compile(r"[\w-]{0,60}")


class _Parser(DefusedXMLParser):  # type: ignore[misc]
    """A parser that refuses entities and document types and notes the line of each element."""

    def __init__(self) -> None:
        super().__init__(forbid_dtd=True, forbid_entities=True, forbid_external=True)

    def _start(self, tag: str, attributes: list[str]) -> Any:
        element = super()._start(tag, attributes)
        element.line = self.parser.CurrentLineNumber
        return element


def load_xml(files: SceneFiles) -> Any:
    """Return the `mi.Scene` of an XML file, with the parameters and the clock of the job as its defaults.

    Raises
    ------
    SceneError
        If an element, plugin, name or number is not allowed; the message names the file and the line.
    """
    reader = _Reader(files)
    root = reader.read(files.name, place="file", depth=0)
    for name in sorted(set(files.job.parameters) - reader.declared):
        files.note(f"parameters.{name} reaches nothing in {files.name}, which has no <default name={name!r}>")
    text = tostring(root, encoding="unicode")
    if not reader.has_light:
        # The text has no light, and a scene is made of it once: the default one goes into the text.
        text = text.removesuffix("</scene>") + _light_text(files) + "</scene>"
    scene = mi.load_string(text, optimize=False)
    _check_loaded(scene, files)
    return scene


class _Reader:
    """The reader of one scene and of what it includes."""

    def __init__(self, files: SceneFiles) -> None:
        self._files = files
        self._values = {name: _text(value) for name, value in files.job.parameters.items()}
        self._values["clock"] = ""  # no <default> changes it, and `_replaced` asks for it where it is used
        self._elements = self._shapes = self._includes = 0
        self.declared: set[str] = set()
        self.has_light = False

    def read(self, name: str, *, place: str, depth: int, beside: str = "") -> Element:
        """Return the checked root of a file."""
        files = self._files
        path = files.path(name, beside=beside, place=place, at_most=MAX_XML_BYTES)
        inside = path.relative_to(files.bundle).as_posix()
        parser = _Parser()
        try:
            parser.feed(path.read_bytes())
            root: Element = parser.close()
        except DefusedXmlException as error:
            raise files.refuse(inside, "XML without document type and entities", type(error).__name__) from error
        except (ParseError, ValueError) as error:
            raise files.refuse(inside, "XML", error) from error
        if root.tag != "scene":
            raise files.refuse(_place(root, inside), "<scene>", f"<{root.tag[:80]}>")
        self._check(root, inside, depth, 0)
        return root

    def _check(self, element: Element, file: str, includes: int, depth: int) -> None:
        files, where = self._files, _place(element, file)
        self._elements += 1
        if self._elements > MAX_ELEMENTS or depth > MAX_DEPTH:
            raise files.refuse(where, f"at most {MAX_ELEMENTS:,} elements, {MAX_DEPTH} deep", "more")
        if element.tag not in _TAGS:
            raise files.refuse(where, f"one of {', '.join(sorted(_TAGS))}", f"<{str(element.tag)[:80]}>")
        for key, value in element.attrib.items():
            element.set(key, self._replaced(value, where))
        self._check_plugin(element, file, where)
        self._check_numbers(element, where)
        if element.tag == "rgb" and _HEX.fullmatch(element.get("value", "")):
            codes = bytes.fromhex(element.get("value", "")[1:])
            element.set("value", " ".join(repr(float(LINEAR[code])) for code in codes))
        kept: list[Element] = []
        for child in element:
            if child.tag in LEFT_OUT:
                files.note(f"{_place(child, file)}: <{child.tag}> is left out: the rig is the camera")
            elif child.tag == "default":
                self._declare(child, file)
            elif child.tag == "include":
                kept += self._included(child, file, includes)
            else:
                self._check(child, file, includes, depth + 1)
                kept.append(child)
        element[:] = kept

    def _declare(self, element: Element, file: str) -> None:
        name, value = element.get("name", ""), element.get("value", "")
        self._values.setdefault(name, self._replaced(value, _place(element, file)))
        self.declared.add(name)

    def _included(self, element: Element, file: str, depth: int) -> list[Element]:
        where = _place(element, file)
        self._includes += 1
        if depth >= MAX_INCLUDE_DEPTH or self._includes > MAX_INCLUDES:
            expected = f"at most {MAX_INCLUDES} includes, {MAX_INCLUDE_DEPTH} deep"
            raise self._files.refuse(where, expected, "more, or a circle")
        named = self._replaced(element.get("filename", ""), where)
        return list(self.read(named, place=f"{where}: filename", depth=depth + 1, beside=file))

    def _replaced(self, text: str, where: str) -> str:
        def value(found: re.Match[str]) -> str:
            if found[1] not in self._values:
                known = ", ".join(f"${name}" for name in sorted(self._values))
                raise self._files.refuse(where, f"one of {known}, each after its <default>", found[0])
            return repr(self._files.clock) if found[1] == "clock" else self._values[found[1]]

        return _NAME.sub(value, text)

    def _check_plugin(self, element: Element, file: str, where: str) -> None:
        files, tag, plugin = self._files, element.tag, element.get("type")
        if tag in PLUGINS and not (tag == "spectrum" and plugin is None):
            if plugin not in PLUGINS[tag]:
                raise files.refuse(f"{where}: type", f"one of {', '.join(PLUGINS[tag])}", repr(plugin))
            self.has_light |= tag == "emitter"
        if tag == "shape":
            self._shapes += 1
            if self._shapes > MAX_SHAPES:
                raise files.refuse(where, f"at most {MAX_SHAPES:,} shapes", "more")
        if "filename" in element.attrib:
            raise files.refuse(f"{where}: filename", f"values, not a file, in <{tag}>", repr(element.get("filename")))
        if tag == "string":
            self._check_string(element, file, where)

    def _check_string(self, element: Element, file: str, where: str) -> None:
        name, value = element.get("name", ""), element.get("value", "")
        if name != "filename":
            if not _WORD.fullmatch(value) and name not in ("wavelengths", "values"):
                raise self._files.refuse(f"{where}: {name[:40]}", "a word of letters and digits", repr(value))
            return
        path = self._files.path(value, beside=file, place=f"{where}: filename")
        suffix = PurePosixPath(value).suffix.lower()
        if suffix in (".obj", ".ply"):
            check_mesh_file(path, self._files, name=value, place=where)
        else:
            check_picture_file(path, self._files, place=f"{where}: {value}")
        element.set("value", str(path))

    def _check_numbers(self, element: Element, where: str) -> None:
        for key in _NUMBERS.get(element.tag, ()):
            for word in re.split(r"[\s,]+", element.get(key, "").strip()):
                if word and not _is_number(word):
                    raise self._files.refuse(f"{where}: {key}", f"finite numbers up to {_MAX_NUMBER:g}", repr(word))


def _place(element: Element, file: str) -> str:
    return f"{file}, line {getattr(element, 'line', '?')}"


def _text(value: float | bool | str) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _is_number(word: str) -> bool:
    try:
        number = float(word)
    except ValueError:
        return False
    return math.isfinite(number) and abs(number) <= _MAX_NUMBER


def _light_text(files: SceneFiles) -> str:
    light = default_light(files)
    x, y, z = light["lippmann_sun"]["direction"]
    return (
        f'<emitter type="constant"><rgb name="radiance" value="{light["lippmann_ambient"]["radiance"]["value"]}"/>'
        f'</emitter><emitter type="directional"><vector name="direction" x="{x!r}" y="{y!r}" z="{z!r}"/>'
        f'<rgb name="irradiance" value="{light["lippmann_sun"]["irradiance"]["value"]}"/></emitter>'
    )


def _check_loaded(scene: Any, files: SceneFiles) -> None:
    """Refuse faces of vertices that a mesh does not have, and too many faces in all; Mitsuba refuses NaN itself."""
    meshes = [shape for shape in scene.shapes() if shape.is_mesh()]
    files.check_faces(sum(mesh.face_count() for mesh in meshes))
    for mesh in meshes:
        parameters = mi.traverse(mesh)
        # A rectangle is a mesh whose faces are not shown.
        if "faces" in parameters and np.asarray(parameters["faces"]).max(initial=0) >= mesh.vertex_count():
            expected = f"faces of its {mesh.vertex_count()} vertices"
            raise files.refuse(f"{files.name}: mesh {mesh.id()[:80]}", expected, "others")
