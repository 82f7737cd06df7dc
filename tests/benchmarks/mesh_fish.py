"""The fish in meshes as a scene of POV-Ray: the same triangles, textures, lights and water, on the same axes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FISH = "rotate 24 * y translate 60 * y"
"""The pose of frame 1; on right-handed axes the scene turns the other way round than its rig sees."""
STANDING = "translate -34 * y"

SKIN = "finish { ambient 0 diffuse 1 specular 0.5 roughness 0.015 }"
MATT = "finish { ambient 0 diffuse 1 }"
SHINING = "finish { ambient 0 diffuse 0 emission 1 }"
"""The sky: a light of POV-Ray at a point does not fade, and would show the shadows of the stems on the wall."""
WATER = """pigment { rgb <0.003, 0.022, 0.033> }
finish { ambient 0 diffuse 1 specular 0.5 roughness 0.002 reflection { 0, 1 fresnel on } conserve_energy }
interior { ior 1.33 }"""

PARTS = {
    "body": ("skin", SKIN, FISH),
    "fins": ("fin", MATT, FISH),
    "lips": ("rgb <0.80, 0.22, 0.03>", SKIN, FISH),
    "mouth": ("rgb <0.01, 0.001, 0.001>", MATT, FISH),
    "eyes": ("eye", SKIN, FISH),
    "eye-rings": ("rgb <0.02, 0.16, 0.55>", SKIN, FISH),
    "stems": ("stem", MATT, STANDING),
    "heads": ("head", MATT, STANDING),
    "leaves": ("leaf", MATT, STANDING),
    "sky": ("sky", SHINING, ""),
}
"""The meshes with their texture or colour, their finish and their place."""


def write_for_povray(scene: Path, file: Path) -> None:
    """Write the scene of a folder as the text of POV-Ray."""
    parts = ["#version 3.7;", "global_settings { assumed_gamma 1 max_trace_level 6 }"]
    for name, (colour, finish, place) in PARTS.items():
        picture = scene / "textures" / f"{colour}.png"
        mapped = f'uv_mapping pigment {{ image_map {{ png "{picture}" gamma srgb interpolate 2 }} }}'
        pigment = mapped if picture.is_file() else f"pigment {{ {colour} }}"
        parts.append(f"{mesh2(scene / 'meshes' / f'{name}.ply')} texture {{ {pigment} {finish} }} {place} }}")
    parts.append(f"{mesh2(scene / 'meshes' / 'water.ply')} {WATER} scale <1, 0.3, 1> {STANDING} }}")
    parts += lights((scene / "scene.xml").read_text())
    file.write_text("\n".join(parts))


def lights(xml: str) -> list[str]:
    """Return the lights of a scene of Mitsuba: parallel ones, and the one at a point as bright on the fish as there."""
    three = r'x="(.*?)" y="(.*?)" z="(.*?)"/>\s*<rgb name="(?:irradiance|intensity)" value="(.*?)"'
    lines = []
    for *direction, irradiance in re.findall(r'<vector name="direction" ' + three, xml):
        place, colour = -1000 * numbers(direction), numbers(irradiance.split()) / np.pi
        lines.append(f"light_source {{ {vector(place)} rgb {vector(colour)} parallel point_at 0 }}")
    for *position, intensity in re.findall(r'<point name="position" ' + three, xml):
        place = numbers(position)
        colour = numbers(intensity.split()) / np.pi / np.square(place - (0, 60, 0)).sum()
        lines.append(f"light_source {{ {vector(place)} rgb {vector(colour)} }}")
    return lines


def numbers(words: list[str]) -> NDArray[np.float64]:
    """Return words as numbers."""
    return np.array(words, dtype=float)


def mesh2(path: Path) -> str:
    """Return the start of a mesh of SDL, `mesh2 {` up to its last list, of a PLY as make_meshes.py writes it."""
    head, _, data = path.read_bytes().partition(b"end_header\n")
    vertices, faces = (int(count) for count in re.findall(rb"element \w+ (\d+)", head))
    width = head.count(b"property float")
    table = np.frombuffer(data, "<f4", vertices * width).reshape(vertices, width).astype(float)
    corner = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
    corners = np.frombuffer(data, corner, faces, offset=4 * vertices * width)["corners"]
    lists = [("vertex_vectors", table[:, :3]), ("normal_vectors", table[:, 3:6])]
    if width == 8:
        lists.append(("uv_vectors", np.stack([table[:, 6], 1 - table[:, 7]], axis=1)))
    rows = [f"{word} {{ {len(values)}, {', '.join(map(vector, values))} }}" for word, values in lists]
    return "mesh2 { " + "\n".join([*rows, f"face_indices {{ {faces}, {', '.join(map(vector, corners))} }}"])


def vector(numbers: NDArray[np.generic]) -> str:
    """Return numbers as a vector of SDL."""
    return f"<{', '.join(f'{number:.7g}' for number in numbers.tolist())}>"
