"""Scenes in Mitsuba's XML: parameters, includes, and what is refused with its line."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.unit.worker.engines.mitsuba.inside.scenes.test_meshes import PLY, picture

Load = Callable[..., Any]
Refusal = Callable[..., str]


def scene(*lines: str) -> str:
    return "\n".join(['<scene version="3.0.0">', *lines, "</scene>"])


BALL = '<shape type="sphere"><float name="radius" value="1"/></shape>'


def test_parameters_and_the_clock_replace_the_defaults_of_their_names(load: Load) -> None:
    text = scene(
        '<default name="radius" value="1"/>', '<default name="clock" value="0"/>',
        '<default name="tint" value="#ffffff"/>', '<default name="kept" value="0.5"/>',
        '<shape type="sphere"><float name="radius" value="$radius"/>',
        '<transform name="to_world"><translate x="$clock"/><scale value="$kept"/></transform>',
        '<bsdf type="diffuse"><rgb name="reflectance" value="$tint"/></bsdf></shape>',
    )  # fmt: skip
    loaded = load({"a.xml": text}, clock=8.0, radius=2.0, tint="#ff0000", other=True)
    assert "clock" in loaded.reads
    assert "clock" not in load({"a.xml": scene(BALL)}).reads
    assert np.asarray(loaded.scene.bbox().max).round(5).ravel().tolist() == [5, 1, 1]
    assert "value = [[1, 0, 0]]" in str(loaded.scene.shapes()[0].bsdf())
    assert [note for note in loaded.notes if "parameters." in note] == [
        "parameters.other reaches nothing in a.xml, which has no <default name='other'>"
    ]


def test_the_camera_of_the_file_is_left_out_and_a_scene_without_light_gets_one(load: Load) -> None:
    loaded = load({"a.xml": scene('<integrator type="path"/>', '<sensor type="perspective"/>', BALL)})
    assert loaded.notes[:2] == (
        "a.xml, line 2: <integrator> is left out: the rig is the camera",
        "a.xml, line 3: <sensor> is left out: the rig is the camera",
    )
    assert len(loaded.scene.emitters()) == 2
    assert len(loaded.scene.sensors()) == 0


def test_includes_meshes_and_textures_are_found_beside_the_file_that_names_them(load: Load) -> None:
    inner = scene(
        '<shape type="ply"><string name="filename" value="b.ply"/><bsdf type="diffuse"><texture type="bitmap" '
        'name="reflectance"><string name="filename" value="../a.png"/></texture></bsdf></shape>',
        '<emitter type="point"><point name="position" value="0, 0, 9"/></emitter>',
    )
    files = {"a.xml": scene('<include filename="in/b.xml"/>', BALL), "in/b.xml": inner, "in/b.ply": PLY}
    loaded = load({**files, "a.png": picture()})
    assert len(loaded.scene.shapes()) == 2
    assert len(loaded.scene.emitters()) == 1


def exr(cols: int, rows: int) -> bytes:
    window = struct.pack("<4i", 0, 0, cols - 1, rows - 1)
    return b"\x76\x2f\x31\x01\x02\0\0\0dataWindow\0box2i\0\x10\0\0\0" + window


BINARY_PLY = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    b"element face 1\nproperty list uchar int vertex_indices\nend_header\n"
)
BOMB = '<!DOCTYPE s [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]><scene version="3.0.0">&b;</scene>'


def mesh(name: str) -> str:
    return scene(f'<shape type="ply"><string name="filename" value="{name}"/></shape>')


def sky(name: str) -> str:
    return scene(BALL, f'<emitter type="envmap"><string name="filename" value="{name}"/></emitter>')


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"a.xml": BOMB}, "a.xml: expected XML without document type and entities"),
        ({"a.xml": "<scene"}, "a.xml: expected XML, got"),
        ({"a.xml": "<shape/>"}, "a.xml, line 1: expected <scene>, got <shape>"),
        ({"a.xml": scene('<include filename="../b.xml"/>')}, "line 2: filename: expected a file inside the bundle"),
        ({"a.xml": scene('<include filename="/etc/passwd"/>')}, "a.xml, line 2: filename: expected the name of a file"),
        ({"a.xml": scene('<include filename="a.xml"/>')}, "a.xml, line 2: expected at most 500 includes, 8 deep"),
        ({"a.xml": scene('<path value="/etc"/>')}, "a.xml, line 2: expected one of boolean, bsdf"),
        ({"a.xml": scene('<medium type="homogeneous"/>')}, "got <medium>"),
        ({"a.xml": scene('<shape type="sdfgrid"/>')}, "a.xml, line 2: type: expected one of cube, cylinder"),
        ({"a.xml": scene('<shape type="$kind"/>')}, "a.xml, line 2: expected one of $clock, each after its <default>"),
        ({"a.xml": scene('<bsdf type="measured"/>')}, "type: expected one of blendbsdf"),
        ({"a.xml": scene('<emitter type="sunsky"/>')}, "type: expected one of area"),
        ({"a.xml": scene('<spectrum name="s" filename="/etc/passwd"/>')}, "filename: expected values, not a file"),
        (
            {"a.xml": scene('<bsdf type="conductor"><string name="material" value="../../x"/></bsdf>')},
            "a.xml, line 2: material: expected a word",
        ),
        ({"a.xml": mesh("../b.ply")}, "a.xml, line 2: filename: expected a file inside the bundle"),
        ({"a.xml": mesh("/b.ply")}, "a.xml, line 2: filename: expected the name of a file inside the bundle"),
        ({"a.xml": mesh("b.ply")}, "a.xml, line 2: filename: expected a file that is in the bundle, got 'b.ply'"),
        (
            {"a.xml": mesh("b.ply"), "b.ply": PLY.replace("face 1", "face 1000000000")},
            "a.xml, line 2: b.ply: element face: expected at most the",
        ),
        (
            {"a.xml": mesh("b.ply"), "b.ply": BINARY_PLY + struct.pack("<9fB3i", math.nan, *range(8), 3, 0, 1, 2)},
            "a.xml: failed to instantiate shape plugin of type ",
        ),
        (
            {"a.xml": mesh("b.ply"), "b.ply": BINARY_PLY + struct.pack("<9fB3i", *range(9), 3, 0, 1, 7)},
            "expected faces of its 3 vertices",
        ),
        ({"a.xml": sky("b.exr"), "b.exr": exr(60_000, 60_000)}, "b.exr: expected a texture of at most 67,108,864 px"),
        (
            {"a.xml": sky("b.hdr"), "b.hdr": "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 90000 +X 90000\n"},
            "b.hdr: expected a texture of at most 67,108,864 px, got 90000 x 90000",
        ),
        ({"a.xml": sky("b.exr"), "b.exr": exr(-5, 3)}, "b.exr: expected an EXR with a dataWindow that has pixels"),
        ({"a.xml": sky("b.tga"), "b.tga": "TRUEVISION"}, "b.tga: expected a mesh (.obj, .ply) or a picture"),
        ({"a.xml": scene(BALL.replace('"1"', '"nan"'))}, "a.xml, line 2: value: expected finite numbers up to"),
        ({"a.xml": scene(BALL.replace('"1"', '"1e30"'))}, "a.xml, line 2: value: expected finite numbers up to"),
        ({"a.xml": scene(BALL * 20_001)}, "expected at most 20,000 shapes"),
        ({"a.xml": scene(BALL.replace("radius", "rarius"))}, "rarius"),
        (
            {"a.xml": scene('<bsdf type="twosided" id="a"><ref id="a"/></bsdf>', BALL)},
            "a.xml",
        ),
    ],
)  # fmt: skip
def test_what_is_not_allowed_is_refused_by_file_and_line(refusal: Refusal, files: dict[str, Any], message: str) -> None:
    assert message in refusal(files)


@pytest.mark.promise("Scenes", "An XML scene whose includes multiply is refused before it is rendered.")
def test_includes_that_multiply_are_refused(refusal: Refusal) -> None:
    files = {f"{n}.xml": scene(*[f'<include filename="{n + 1}.xml"/>'] * 30) for n in range(7)}
    assert "expected at most 500 includes" in refusal({**files, "7.xml": scene(BALL)})


@pytest.mark.promise("Scenes", "A scene of Mitsuba reads no file outside its bundle, not by a link either.")
def test_links_are_refused(load: Load, refusal: Refusal, tmp_path: Path) -> None:
    (tmp_path / "out").symlink_to("/etc")
    (tmp_path / "b.ply").symlink_to("/etc/passwd")
    assert "expected a file inside the bundle, got 'b.ply', which is a link" in refusal({"a.xml": mesh("b.ply")})
    assert "expected a file inside the bundle, got 'out/b.ply', which is a link" in refusal(
        {"a.xml": mesh("out/b.ply")}
    )
