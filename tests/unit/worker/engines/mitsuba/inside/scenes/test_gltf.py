"""glTF scenes: places, materials, lights and movement, and what is refused."""

from __future__ import annotations

import io
import json
import math
import struct
import zlib
from collections.abc import Callable
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from tests.unit.worker.engines.mitsuba.inside.scenes.glb import Glb, square

Load = Callable[..., Any]
Refusal = Callable[..., str]


def corners(loaded: Any) -> NDArray[np.float64]:
    box = loaded.scene.bbox()
    return np.array([box.min, box.max], dtype=np.float64).round(5).squeeze()


def hit(loaded: Any, x: float, y: float) -> Any:
    """Return what a ray along -z meets."""
    return loaded.scene.ray_intersect(mi.Ray3f([x, y, 50.0], [0.0, 0.0, -1.0]))


def picture(cols: int, rows: int, *pixels: tuple[int, int, int]) -> bytes:
    made = Image.new("RGB", (cols, rows))
    made.putdata(pixels)
    data = io.BytesIO()
    made.save(data, "PNG")
    return data.getvalue()


def test_nodes_place_meshes_and_a_scene_without_light_gets_one(load: Load) -> None:
    glb = square()
    glb.document["nodes"] = [
        {"children": [1], "translation": [10, 0, 0], "scale": [2, 2, 2]},
        {"mesh": 0, "rotation": [0, math.sin(math.pi / 4), 0, math.cos(math.pi / 4)]},
    ]
    loaded = load({"a.glb": glb.data()})
    assert corners(loaded).tolist() == [[10, -2, -2], [10, 2, 2]]
    assert len(loaded.scene.emitters()) == 2
    assert any("a.glb has no light" in note for note in loaded.notes)


def test_a_mirrored_node_keeps_its_front(load: Load) -> None:
    glb = square()
    glb.document["nodes"][0]["scale"] = [-1, 1, 1]
    assert float(np.asarray(hit(load({"a.glb": glb.data()}), 0.1, 0.2).n.z).item()) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("kind", "values", "expected"),
    [
        ("LINEAR", [(0, 0, 0), (4, 0, 0)], 1.0),
        ("STEP", [(0, 0, 0), (4, 0, 0)], 0.0),
        ("CUBICSPLINE", [(0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0), (4, 0, 0), (0, 0, 0)], 0.625),
    ],
)
def test_the_clock_is_the_time_of_the_animation(
    load: Load, kind: str, values: list[tuple[float, ...]], expected: float
) -> None:
    glb = square()
    sampler = {"input": glb.accessor([0, 2]), "output": glb.accessor(values), "interpolation": kind}
    channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
    glb.document["animations"] = [{"samplers": [sampler], "channels": [channel]}]
    moved = {clock: corners(load({"a.glb": glb.data()}, clock=clock))[0][0] + 1 for clock in (-1, 0.5, 9)}
    assert moved == {-1: 0, 0.5: pytest.approx(expected), 9: 4}


def test_a_rotation_turns_with_even_speed(load: Load) -> None:
    glb = square()
    ends = [(0, 0, 0, 1), (0, 0, math.sin(math.pi / 4), math.cos(math.pi / 4))]
    sampler = {"input": glb.accessor([0, 1]), "output": glb.accessor(ends)}
    channel = {"sampler": 0, "target": {"node": 0, "path": "rotation"}}
    glb.document["animations"] = [{"samplers": [sampler], "channels": [channel]}]
    turn = math.radians(30)
    side = corners(load({"a.glb": glb.data()}, clock=1 / 3))[1][0]
    assert side == pytest.approx(math.cos(turn) + math.sin(turn), abs=1e-4)


def test_joints_move_the_vertices_of_a_skin(load: Load) -> None:
    glb = square()
    glb.primitive["attributes"]["JOINTS_0"] = glb.accessor([[0, 1, 0, 0]] * 4, "uint8")
    glb.primitive["attributes"]["WEIGHTS_0"] = glb.accessor([[1, 0, 0, 0], [0, 1, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0]])
    glb.document["nodes"] = [{"mesh": 0, "skin": 0}, {}, {"translation": [5, 0, 0]}]
    glb.document["scenes"] = [{"nodes": [0, 1, 2]}]
    glb.document["skins"] = [{"joints": [1, 2]}]
    assert corners(load({"a.glb": glb.data()})).tolist() == [[-1, -1, 0], [6, 1, 0]]


def test_the_first_row_of_a_texture_is_at_the_top(load: Load) -> None:
    glb = square()
    view = glb.view(picture(1, 2, (255, 255, 255), (0, 0, 0)))
    glb.document |= {
        "images": [{"bufferView": view}],
        "samplers": [{"wrapS": 33071, "wrapT": 33071}],
        "textures": [{"source": 0, "sampler": 0}],
        "materials": [{"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}}],
    }
    glb.primitive["material"] = 0
    loaded = load({"a.glb": glb.data()})
    light = [
        np.asarray(found.emitter(loaded.scene).eval(found)).mean()
        for found in (hit(loaded, 0, 0.9), hit(loaded, 0, -0.9))
    ]
    assert light == pytest.approx([1.0, 0.0], abs=0.01)
    assert not any("has no light" in note for note in loaded.notes)


def test_materials_and_lights_become_those_of_mitsuba_and_what_is_dropped_is_noted(load: Load) -> None:
    glb = square()
    glb.document |= {
        "images": [{"uri": "maps/a.png"}],
        "textures": [{"source": 0}],
        "materials": [
            {
                "pbrMetallicRoughness": {
                    "baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 1, 1, 1],
                    "metallicRoughnessTexture": {"index": 0},
                },
                "normalTexture": {"index": 0, "scale": 0.5},
                "occlusionTexture": {"index": 0},
                "alphaMode": "MASK",
                "extensions": {"KHR_materials_sheen": {}},
            }
        ],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 3}, {"type": "point"}]}},
    }  # fmt: skip
    glb.document["nodes"] += [{"extensions": {"KHR_lights_punctual": {"light": number}}} for number in (0, 1)]
    glb.document["scenes"] = [{"nodes": [0, 1, 2]}]
    glb.primitive["material"] = 0
    loaded = load({"a.glb": glb.data(), "maps/a.png": picture(2, 2, *[(90, 90, 90)] * 4)}, light_scale=2.0, speed=1.0)
    assert len(loaded.scene.emitters()) == 2
    notes = " ".join(loaded.notes)
    assert "KHR_materials_sheen is left out" in notes
    assert "occlusion texture is left out" in notes
    assert "parameters.speed reaches nothing" in notes
    assert "has no light" not in notes


def test_colours_of_vertices_stay_colours(load: Load) -> None:
    glb = square()
    glb.primitive["attributes"]["COLOR_0"] = glb.accessor([[1, 0, 0]] * 4)
    loaded = load({"a.glb": glb.data()})
    found = hit(loaded, 0.1, 0.2)
    assert np.asarray(found.shape.eval_attribute_3("vertex_color", found)).ravel().tolist() == [1, 0, 0]


def _changed(**parts: Any) -> Glb:
    glb = square()
    glb.document |= parts
    return glb


def _accessor(**parts: Any) -> Glb:
    glb = square()
    glb.document["accessors"][0] |= parts
    return glb


def _nan() -> Glb:
    glb = square()
    glb.binary = struct.pack("<f", math.nan) + glb.binary[4:]
    return glb


def _image(**image: Any) -> Glb:
    glb = _changed(images=[image], textures=[{"source": 0}])
    glb.document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    glb.primitive["material"] = 0
    return glb


@pytest.mark.parametrize(
    ("glb", "message"),
    [
        (_accessor(count=1_000_000_000), "accessors.0.count: expected at most the 48 bytes of its buffer view"),
        (_accessor(byteOffset=2**40), "accessors.0.count: expected at most"),
        (_accessor(type="VEC2"), "accessors.0.type: expected VEC3"),
        (_accessor(componentType=9), "accessors.0.componentType: expected 5120"),
        (_accessor(bufferView=99), "accessors.0.bufferView: expected one of the 3 bufferViews, got 99"),
        (_nan(), "accessors.0: expected finite numbers, got NaN"),
        (_changed(nodes=[{"children": [0]}]), "nodes.0: expected a node with one parent"),
        (_changed(nodes=[{"mesh": 7}]), "nodes.0.mesh: expected one of the 1 meshes, got 7"),
        (_changed(nodes=[{"mesh": 0}] * 2, scenes=[{"nodes": [0, 1, 9]}]), "nodes.9: expected one of the 2 nodes"),
        (_changed(extensionsRequired=["KHR_draco_mesh_compression"]), "extensionsRequired: expected some of"),
        (_changed(asset={"version": "1.0"}), "asset.version: expected 2.0, got 1.0"),
        (_image(uri="../../etc/passwd"), "images.0.uri: expected a file inside the bundle"),
        (_image(uri="/etc/passwd"), "images.0.uri: expected the name of a file inside the bundle"),
        (_image(uri="https://example.org/a.png"), "images.0.uri: expected the name of a file inside the bundle"),
        (_image(uri="lost.png"), "images.0.uri: expected a file that is in the bundle, got 'lost.png'"),
        (_image(uri="data:image/png;base64,AAAA"), "images.0: expected a texture of PNG, JPEG, WEBP"),
    ],
)  # fmt: skip
def test_a_damaged_or_hostile_file_is_refused_by_the_place(refusal: Refusal, glb: Glb, message: str) -> None:
    assert message in refusal({"a.glb": glb.data()})


@pytest.mark.promise("Scenes", "A model that announces too many faces is refused before they are read.")
def test_faces_are_counted_over_all_nodes_before_any_is_read(refusal: Refusal) -> None:
    glb = square()
    glb.document["accessors"][2]["count"] = 30_000_000
    glb.document["nodes"] = [{"mesh": 0}] * 3
    glb.document["scenes"] = [{"nodes": [0, 1, 2]}]
    assert "expected at most 20,000,000 faces in all, got 30,000,000" in refusal({"a.glb": glb.data()})


@pytest.mark.promise("Scenes", "A texture of too many pixels is refused by its header, before it is decoded.")
def test_a_picture_of_too_many_pixels_is_refused_by_its_header(refusal: Refusal) -> None:
    bomb = picture(1, 1, (0, 0, 0))
    size = bomb.index(b"IHDR") + 4
    head = b"IHDR" + struct.pack(">II", 60_000, 60_000) + bomb[size + 8 : size + 13]
    bomb = bomb[: size - 4] + head + struct.pack(">I", zlib.crc32(head)) + bomb[size + 17 :]
    assert "images.0: expected a texture of" in refusal({"a.glb": _image(uri="a.png").data(), "a.png": bomb})


def test_a_picture_is_one_texture_for_all_materials_that_use_it_alike(
    load: Load, refusal: Refusal, monkeypatch: pytest.MonkeyPatch
) -> None:
    from worker.engines.mitsuba.inside.scenes import pictures

    monkeypatch.setattr(pictures, "MAX_ALL_TEXTURES_PX", 5)
    glb = _image(uri="a.png")
    glb.document["materials"] *= 3
    glb.document["meshes"][0]["primitives"] = [{**glb.primitive, "material": number} for number in range(3)]
    files = {"a.glb": glb.data(), "a.png": picture(2, 2, *[(90, 90, 90)] * 4)}
    assert len(load(files).scene.shapes()) == 3
    other = {"baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 1, 1, 1]}
    glb.document["materials"] = [*glb.document["materials"][:2], {"pbrMetallicRoughness": other}]
    assert "expected at most 5 px in all textures, got 8" in refusal({**files, "a.glb": glb.data()})


@pytest.mark.parametrize(
    ("at", "number", "message"),
    [
        (4, 1, "header: expected version 2 of the .glb container, got 1"),
        (8, 2**31, "length: expected the size of the file"),
        (12, 2**31, "chunk: expected at most the"),
        (16, 0x4E4942, "first chunk: expected JSON"),
    ],
)
def test_a_container_with_wrong_lengths_is_refused(refusal: Refusal, at: int, number: int, message: str) -> None:
    data = square().data()
    assert message in refusal({"a.glb": data[:at] + struct.pack("<I", number) + data[at + 4 :]})
    assert "a.glb: " in refusal({"a.glb": data[:7]})


def test_a_gltf_with_a_buffer_beside_it_is_read_and_a_short_one_refused(load: Load, refusal: Refusal) -> None:
    glb = square()
    glb.document["buffers"] = [{"byteLength": len(glb.binary), "uri": "a.bin"}]
    text = json.dumps(glb.document)
    assert corners(load({"a.gltf": text, "a.bin": glb.binary}))[1].tolist() == [1, 1, 0]
    assert "buffers.0.byteLength: expected at most the 9 bytes there" in refusal(
        {"a.gltf": text, "a.bin": glb.binary[:9]}
    )
