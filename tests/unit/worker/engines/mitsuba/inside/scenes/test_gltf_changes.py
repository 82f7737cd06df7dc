"""Morph targets, sparse accessors and textures that are moved: by the formulas of the glTF specification."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.unit.worker.engines.mitsuba.inside.scenes.glb import Glb, square
from tests.unit.worker.engines.mitsuba.inside.scenes.test_gltf import corners, hit, picture

Load = Callable[..., Any]
Refusal = Callable[..., str]


def with_targets(weights: list[float] | None = None) -> Glb:
    """Return a square whose first target moves all corners along z, and whose second one the right ones along x."""
    glb = square()
    lifted, wider = [(0, 0, 2)] * 4, [(0, 0, 0), (3, 0, 0), (3, 0, 0), (0, 0, 0)]
    glb.primitive["targets"] = [{"POSITION": glb.accessor(lifted)}, {"POSITION": glb.accessor(wider)}]
    if weights is not None:
        glb.document["meshes"][0]["weights"] = weights
    return glb


@pytest.mark.parametrize(
    ("mesh", "node", "expected"),
    [
        (None, None, [[-1, -1, 0], [1, 1, 0]]),
        ([0.5, 0.0], None, [[-1, -1, 1], [1, 1, 1]]),
        ([0.5, 0.0], [1.0, -0.5], [[-1, -1, 2], [-0.5, 1, 2]]),
    ],
)
def test_targets_move_vertices_by_their_weights(
    load: Load, mesh: list[float] | None, node: list[float] | None, expected: list[list[float]]
) -> None:
    glb = with_targets(mesh)
    if node is not None:
        glb.document["nodes"][0]["weights"] = node
    loaded = load({"a.glb": glb.data()})
    assert corners(loaded).tolist() == expected
    assert not any("morph" in note for note in loaded.notes)


@pytest.mark.parametrize(("kind", "expected"), [("LINEAR", 0.5), ("STEP", 0.0), ("CUBICSPLINE", 0.5)])
def test_an_animation_moves_the_weights_and_keeps_the_matrix_of_the_node(
    load: Load, kind: str, expected: float
) -> None:
    glb = with_targets([9.0, 9.0])
    glb.document["nodes"][0]["matrix"] = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 0, 0, 1]
    keys = [(0.0, 0.0), (1.0, 0.0)]
    values = [pair for key in keys for pair in ((0.0, 0.0), key, (0.0, 0.0))] if kind == "CUBICSPLINE" else keys
    sampler = {"input": glb.accessor([0, 2]), "output": glb.accessor(np.ravel(values)), "interpolation": kind}
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    glb.document["animations"] = [{"samplers": [sampler], "channels": [channel]}]
    loaded = load({"a.glb": glb.data()}, clock=1.0)
    assert corners(loaded).tolist() == [[9, -1, 2 * expected], [11, 1, 2 * expected]]
    assert not any("stands still" in note for note in loaded.notes)


def test_normals_turn_with_their_target(load: Load) -> None:
    glb = square()
    glb.primitive["attributes"]["NORMAL"] = glb.accessor([(0, 0, 1)] * 4)
    glb.primitive["targets"] = [{"NORMAL": glb.accessor([(1, 0, 0)] * 4)}]
    glb.document["meshes"][0]["weights"] = [1.0]
    normal = np.asarray(hit(load({"a.glb": glb.data()}), 0.1, 0.2).sh_frame.n).ravel()
    assert normal == pytest.approx([math.sqrt(0.5), 0, math.sqrt(0.5)], abs=1e-5)


def sparse(glb: Glb, places: list[int], values: list[tuple[float, ...]], *, count: int = 4, **more: Any) -> int:
    """Add an accessor of zeros but for some elements, and return its number."""
    held = {
        "count": len(places),
        "indices": {"bufferView": glb.view(np.array(places, "<u2").tobytes()), "componentType": 5123},
        "values": {"bufferView": glb.view(np.array(values, "<f4").tobytes())},
    }
    glb.document["accessors"].append({"componentType": 5126, "count": count, "type": "VEC3", "sparse": held, **more})
    return len(glb.document["accessors"]) - 1


def test_a_sparse_target_moves_the_vertices_that_it_names(load: Load) -> None:
    glb = square()
    glb.primitive["targets"] = [{"POSITION": sparse(glb, [1, 2], [(3, 0, 0), (5, 0, 1)])}]
    glb.document["meshes"][0]["weights"] = [1.0]
    assert corners(load({"a.glb": glb.data()})).tolist() == [[-1, -1, 0], [6, 1, 1]]


def test_a_sparse_accessor_changes_the_numbers_of_its_buffer_view(load: Load) -> None:
    glb = square()
    base = glb.document["accessors"][0]
    glb.primitive["attributes"]["POSITION"] = sparse(glb, [0], [(-4, -1, 0)], bufferView=base["bufferView"])
    assert corners(load({"a.glb": glb.data()})).tolist() == [[-4, -1, 0], [1, 1, 0]]


@pytest.mark.parametrize(
    ("places", "more", "message"),
    [
        ([2, 1], {}, "sparse.indices: expected places that rise, below 4, got others"),
        ([1, 4], {}, "sparse.indices: expected places that rise, below 4, got others"),
        ([1, 2], {"count": 10**9}, "a sparse one of at most 20,000,000, got 1,000,000,000 without"),
        ([1, 2], {"sparse": None}, "expected an accessor with a buffer view"),
        ([1, 2], {"count": 5}, "targets.0.POSITION: expected 4 values as of POSITION, got 5"),
    ],
)
def test_wrong_sparse_accessors_are_refused(
    refusal: Refusal, places: list[int], more: dict[str, Any], message: str
) -> None:
    glb = square()
    number = sparse(glb, places, [(0, 0, 0)] * 2)
    glb.document["accessors"][number] |= more
    glb.primitive["targets"] = [{"POSITION": number}]
    glb.document["meshes"][0]["weights"] = [1.0]
    assert message in refusal({"a.glb": glb.data()})


@pytest.mark.parametrize("weights", [[1.0], [1.0, 2.0, 3.0]])
def test_weights_that_are_not_one_of_each_target_are_refused(refusal: Refusal, weights: list[float]) -> None:
    assert "targets: expected at most 1000 morph targets, with a weight of each or none, got 2" in refusal(
        {"a.glb": with_targets(weights).data()}
    )


def textured(transform: Any) -> Glb:
    """Return a square that shines with a picture: red, green in the upper row, blue, white in the lower one."""
    glb = square()
    view = glb.view(picture(2, 2, (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255)))
    info = {"index": 0, "extensions": {"KHR_texture_transform": transform}}
    glb.document |= {
        "images": [{"bufferView": view}],
        "samplers": [{"magFilter": 9728}],
        "textures": [{"source": 0, "sampler": 0}],
        "materials": [{"emissiveFactor": [1, 1, 1], "emissiveTexture": info}],
        "extensionsRequired": ["KHR_texture_transform"],
    }
    glb.primitive["material"] = 0
    return glb


COLOURS = {"red": [1, 0, 0], "green": [0, 1, 0], "blue": [0, 0, 1], "white": [1, 1, 1]}


@pytest.mark.parametrize(
    ("transform", "upper", "lower"),
    [
        ({}, ("red", "green"), ("blue", "white")),
        ({"offset": [0.5, 0.0]}, ("green", "red"), ("white", "blue")),
        ({"offset": [0.0, 0.5]}, ("blue", "white"), ("red", "green")),
        ({"scale": [0.5, 0.5]}, ("red", "red"), ("red", "red")),
        # (u, v) becomes (v, -u): the point at the upper right, u = 3/4 and v = 1/4, shows (1/4, -3/4), which is the
        # upper left of the picture. Counter-clockwise coordinates turn the picture clockwise.
        ({"rotation": math.pi / 2}, ("blue", "red"), ("white", "green")),
        ({"rotation": math.pi / 2, "offset": [0, 1], "scale": [1, 1]}, ("blue", "red"), ("white", "green")),
    ],
)
def test_a_texture_is_scaled_turned_and_moved(
    load: Load, transform: dict[str, Any], upper: tuple[str, str], lower: tuple[str, str]
) -> None:
    loaded = load({"a.glb": textured(transform).data()})
    for y, row in ((0.5, upper), (-0.5, lower)):
        for x, colour in zip((-0.5, 0.5), row, strict=True):
            found = hit(loaded, x, y)
            light = np.asarray(found.emitter(loaded.scene).eval(found)).ravel()
            assert light.tolist() == pytest.approx(COLOURS[colour], abs=0.01), (x, y)
    assert not any("texture" in note for note in loaded.notes)


@pytest.mark.parametrize(
    ("transform", "message"),
    [
        ({"offset": [1]}, "offset: expected 2 numbers up to 1e6, got [1]"),
        ({"scale": "big"}, "scale: expected 2 numbers up to 1e6, got 'big'"),
        ({"rotation": 1e300}, "rotation: expected 1 numbers up to 1e6"),
        ({"rotation": True}, "rotation: expected 1 numbers up to 1e6"),
    ],
)
def test_wrong_texture_transforms_are_refused(refusal: Refusal, transform: Any, message: str) -> None:
    assert f"materials.0.emissiveTexture.extensions.KHR_texture_transform.{message}" in refusal(
        {"a.glb": textured(transform).data()}
    )
