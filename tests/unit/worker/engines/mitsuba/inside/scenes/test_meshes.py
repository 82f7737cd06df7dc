"""Scenes of one mesh file, .obj or .ply, and what is refused."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

Load = Callable[..., Any]
Refusal = Callable[..., str]

OBJ = """mtllib a.mtl
v -1 -1 0
v 1 -1 0
v 1 1 0
vt 0 0
vt 1 0
vt 1 1
usemtl red
f 1/1 2/2 3/3
"""
PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 1
property list uchar int vertex_indices
end_header
0 0 0 255 0 0
2 0 0 255 0 0
0 3 0 255 0 0
3 0 1 2
"""


def picture() -> bytes:
    data = io.BytesIO()
    Image.new("RGB", (2, 2), (200, 10, 10)).save(data, "PNG")
    return data.getvalue()


def test_an_obj_with_its_material_is_read(load: Load) -> None:
    files = {"m/a.obj": OBJ, "m/a.mtl": "newmtl red\nKd 1 0 0\nmap_Kd a.png\nmap_bump a.png\n", "m/a.png": picture()}
    loaded = load(files)
    assert np.asarray(loaded.scene.bbox().max).round(5).ravel().tolist() == [1, 1, 0]
    assert len(loaded.scene.emitters()) == 2
    assert "a.mtl: map_bump is left out" in loaded.notes
    assert "BitmapTexture" in str(loaded.scene.shapes()[0].bsdf())


def test_a_ply_keeps_the_colours_of_its_vertices(load: Load) -> None:
    loaded = load({"a.ply": PLY}, speed=1.0)
    found = loaded.scene.ray_intersect(mi.Ray3f([0.2, 0.2, 5.0], [0.0, 0.0, -1.0]))
    assert np.asarray(found.shape.eval_attribute_3("vertex_color", found)).ravel().tolist() == [1, 0, 0]
    assert any("parameters.speed reaches nothing" in note for note in loaded.notes)


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"a.ply": PLY.replace("vertex 3", "vertex 1000000000")}, "a.ply: element vertex: expected at most the"),
        ({"a.ply": PLY.replace("face 1", "face 1000000000")}, "a.ply: element face: expected at most the"),
        ({"a.ply": PLY.replace("face 1", "face -1")}, "a.ply: element face: expected at most the"),
        (
            {"a.ply": PLY.replace("2 0 0 255", "nan 0 0 255")},
            "a.ply: mesh0: expected vertices that are finite, got NaN",
        ),
        ({"a.ply": PLY.replace("3 0 1 2", "3 0 1 7")}, "a.ply"),
        ({"a.ply": "no mesh"}, "a.ply: expected a .ply whose header ends within"),
        ({"a.ply": PLY.partition("end_header")[0]}, "a.ply: expected a .ply whose header ends within"),
        ({"a.obj": OBJ}, "a.obj: mtllib: expected a file that is in the bundle, got 'a.mtl'"),
        (
            {"a.obj": OBJ.replace("a.mtl", "/etc/passwd")},
            "a.obj: mtllib: expected the name of a file inside the bundle",
        ),
        ({"a.obj": OBJ.replace("a.mtl", "../a.mtl")}, "a.obj: mtllib: expected a file inside the bundle"),
        (
            {"a.obj": OBJ, "a.mtl": "newmtl red\nmap_Kd ../../b.png\n"},
            "a.mtl: map_Kd: expected a file inside the bundle, got '../../b.png'",
        ),
        ({"a.obj": OBJ, "a.mtl": "newmtl red\nmap_Kd a.mtl\n"}, "a.mtl: map_Kd: expected a texture of"),
        ({"a.obj": "v 0 0 0\n"}, "a.obj: expected a mesh"),
        ({"a.obj": "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"}, "a.obj: mesh0: expected vertices that are finite"),
    ],
)
def test_a_damaged_or_hostile_file_is_refused_by_the_place(
    refusal: Refusal, files: dict[str, str], message: str
) -> None:
    assert message in refusal(files)


def test_a_scene_reads_the_stage_for_the_light_that_it_gets_and_no_clock(load: Load) -> None:
    assert load({"a.obj": OBJ, "a.mtl": "newmtl red\nKd 1 0 0\n"}).reads == {"stage"}
