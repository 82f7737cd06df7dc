"""The tree of a glTF file at a time: the matrices of its nodes, moved by an animation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lippmann.untrusted.gltf_file import Animation, AnimationSampler, Channel, Node
from worker.engines.mitsuba.inside.scenes.gltf_accessors import GltfArrays

MAX_NODES = 100_000
_PATHS = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3"}

Matrix = NDArray[np.float64]
"""A matrix, shape (4, 4), that takes columns."""


def world_matrices(arrays: GltfArrays) -> dict[int, Matrix]:
    """Return the matrix from each node of the scene to the scene, at the clock of the job in seconds.

    Raises
    ------
    SceneError
        If the nodes are no tree, or the animation is wrong.
    """
    document, files = arrays.document, arrays.files
    moved = _moved(arrays)
    if document.scenes:
        roots = arrays.item("scenes", document.scene, f"{files.name}: scene").nodes
    else:
        below = {child for node in document.nodes for child in node.children}
        roots = tuple(index for index in range(len(document.nodes)) if index not in below)
    found: dict[int, Matrix] = {}
    waiting = [(root, np.eye(4)) for root in reversed(roots)]
    while waiting:
        index, parent = waiting.pop()
        place = f"{files.name}: nodes.{index}"
        node: Node = arrays.item("nodes", index, place)
        if index in found:
            raise files.refuse(place, "a node with one parent", "a second one, or a circle")
        found[index] = parent @ local_matrix(node, moved.get(index, {}))
        if len(found) > MAX_NODES:
            raise files.refuse(f"{files.name}: nodes", f"at most {MAX_NODES:,}", "more")
        waiting += [(child, found[index]) for child in reversed(node.children)]
    return found


def local_matrix(node: Node, moved: dict[str, NDArray[np.float64]]) -> Matrix:
    """Return the matrix of a node, with the properties that an animation moves.

    >>> local_matrix(Node(translation=(1, 2, 3)), {})[:3, 3].tolist()
    [1.0, 2.0, 3.0]
    """
    if node.matrix is not None and not moved:
        return np.array(node.matrix, dtype=np.float64).reshape(4, 4).T
    translation, rotation, scale = (
        np.asarray(moved.get(path, getattr(node, path)), dtype=np.float64) for path in _PATHS
    )
    matrix = np.eye(4)
    matrix[:3, :3] = _rotation(rotation) * scale
    matrix[:3, 3] = translation
    return matrix


def _rotation(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    length = float(np.linalg.norm(quaternion))
    x, y, z, w = quaternion / length if length > 0 else np.array([0.0, 0.0, 0.0, 1.0])
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def morph_weights(arrays: GltfArrays) -> dict[int, NDArray[np.float64]]:
    """Return the weights of the morph targets of nodes that an animation moves, (target,), by node."""
    found: dict[int, NDArray[np.float64]] = {}
    for place, channel, sampler in _channels(arrays):
        node = channel.target.node
        if channel.target.path == "weights" and node is not None:
            found[node] = _sampled(arrays, sampler, "weights", place)
    return found


def _moved(arrays: GltfArrays) -> dict[int, dict[str, NDArray[np.float64]]]:
    """Return the properties of the nodes that the chosen animation moves, by node and path, but for weights."""
    found: dict[int, dict[str, NDArray[np.float64]]] = {}
    for place, channel, sampler in _channels(arrays):
        path, node = channel.target.path, channel.target.node
        if node is None or path not in (*_PATHS, "weights"):
            arrays.files.note(f"{place} moves {path!r}, which stands still")
        elif path in _PATHS:
            found.setdefault(node, {})[path] = _sampled(arrays, sampler, path, place)
    return found


def _channels(arrays: GltfArrays) -> Iterator[tuple[str, Channel, AnimationSampler]]:
    """Yield the channels of the animation that plays, with their places and samplers."""
    files, animations = arrays.files, arrays.document.animations
    if not animations:
        return
    chosen = int(files.value("animation", 0))
    if not 0 <= chosen < len(animations):
        raise files.refuse("parameters.animation", f"from 0 to {len(animations) - 1}", chosen)
    if len(animations) > 1:
        files.note(f"{files.name} has {len(animations)} animations; number {chosen} plays (parameters.animation)")
    animation: Animation = animations[chosen]
    for number, channel in enumerate(animation.channels):
        place = f"{files.name}: animations.{chosen}.channels.{number}"
        if channel.sampler >= len(animation.samplers):
            raise files.refuse(f"{place}.sampler", f"one of the {len(animation.samplers)} samplers", channel.sampler)
        yield place, channel, animation.samplers[channel.sampler]


def _sampled(arrays: GltfArrays, sampler: AnimationSampler, path: str, place: str) -> NDArray[np.float64]:
    times = arrays.accessor(sampler.input, f"{place}, times", types=("SCALAR",))[:, 0].astype(np.float64)
    kind = "SCALAR" if path == "weights" else _PATHS[path]
    values = arrays.accessor(sampler.output, f"{place}, values", types=(kind,)).astype(np.float64)
    if (np.diff(times) <= 0).any():
        raise arrays.files.refuse(f"{place}, times", "times that increase", "others")
    keys = len(times) * (3 if sampler.interpolation == "CUBICSPLINE" else 1)
    if path == "weights" and len(values) % keys == 0:
        values = values.reshape(keys, -1)  # those of all targets, key by key
    if len(values) != keys:
        raise arrays.files.refuse(f"{place}, values", f"{keys} for {len(times)} times", len(values))
    return interpolated(times, values, arrays.files.clock, sampler.interpolation, is_rotation=path == "rotation")


def interpolated(
    times: NDArray[np.float64], values: NDArray[np.float64], time: float, kind: str, *, is_rotation: bool
) -> NDArray[np.float64]:
    """Return the value of a channel at a time; before the first and after the last key it stands still.

    Parameters
    ----------
    times
        The times of the keys, shape (key,), s.
    values
        The values, shape (key, width); of a cubic spline (3 * key, width): in-tangent, value and out-tangent of each.
    time
        The time, s.
    kind
        LINEAR, STEP or CUBICSPLINE.
    is_rotation
        True for quaternions, between which LINEAR is spherical.

    Notes
    -----
    The formulas are those of the glTF 2.0 specification, appendix C.

    >>> interpolated(np.array([0.0, 2.0]), np.array([[0.0], [4.0]]), 0.5, "LINEAR", is_rotation=False).tolist()
    [1.0]
    """
    is_cubic = kind == "CUBICSPLINE"
    points: NDArray[np.float64] = values[1::3] if is_cubic else values
    if time <= times[0] or len(times) == 1:
        return np.asarray(points[0])
    if time >= times[-1]:
        return np.asarray(points[-1])
    key = int(np.searchsorted(times, time, side="right")) - 1
    span = float(times[key + 1] - times[key])
    share = (time - float(times[key])) / span
    before, after = points[key], points[key + 1]
    if kind == "STEP":
        return np.asarray(before)
    if not is_cubic:
        return _slerp(before, after, share) if is_rotation else np.asarray(before + share * (after - before))
    outward, inward = values[3 * key + 2] * span, values[3 * (key + 1)] * span
    square, cube = share**2, share**3
    return np.asarray(
        (2 * cube - 3 * square + 1) * before
        + (cube - 2 * square + share) * outward
        + (3 * square - 2 * cube) * after
        + (cube - square) * inward
    )


def _slerp(before: NDArray[np.float64], after: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    cosine = float(before @ after)
    after, cosine = (after, cosine) if cosine >= 0 else (-after, -cosine)
    angle = float(np.arccos(min(1.0, cosine)))
    if angle < 1e-6:
        return np.asarray(before + share * (after - before))
    return np.asarray((np.sin((1 - share) * angle) * before + np.sin(share * angle) * after) / np.sin(angle))
