"""The readers of meshes and splats that are fuzzed: those that `lippmann scenes init` runs outside the sandbox."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from random import Random

import numpy as np

from lippmann.untrusted.gltf_file import read_gltf
from povtemplates.catalogue import scene_folders
from tests.security.mutations import mutated_bytes
from tests.unit.worker.engines.mitsuba.inside.scenes.splat_text import write_splats
from worker.engines.mitsuba.inside.scenes.splat_file import is_splats, read_splats

Read = Callable[[bytes], object]
Make = Callable[[Random], bytes]

_JSON_CHUNK = 0x4E4F534A
_CUT_BYTES = 64
"""The bytes of arrays and textures that an input keeps: the reader looks at the description of them."""


@cache
def _models() -> tuple[bytes, ...]:
    """Return the built-in glTF model with and without its arrays, and its JSON alone."""
    data = (scene_folders()["turning-knot"] / "knot.glb").read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    text, binary = data[20 : 20 + length], data[20 + length :]
    cut = struct.pack("<II", _CUT_BYTES, *struct.unpack_from("<I", binary, 4)) + binary[8 : 8 + _CUT_BYTES]
    heads = [struct.pack("<4s2I", b"glTF", 2, 20 + length + len(rest)) for rest in (cut, b"")]
    chunk = struct.pack("<II", length, _JSON_CHUNK) + text
    return heads[0] + chunk + cut, heads[1] + chunk, text


@cache
def _splats() -> tuple[bytes, ...]:
    with tempfile.TemporaryDirectory() as folder:
        path = write_splats(
            Path(folder) / "a.ply", np.eye(3), np.full((3, 3), 0.1), opacities=[0.9, 0.5, 0.2], colours=np.eye(3)
        )
        return (path.read_bytes(),)


def _read_model(data: bytes) -> object:
    return read_gltf(data, field="model.glb").document.model_dump_json()


def _read_splats(data: bytes) -> object:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.ply"
        path.write_bytes(data)
        return read_splats(path), is_splats(path)


SCENE_READERS: Mapping[str, tuple[Make, Read]] = {
    "model.glb": (lambda random: mutated_bytes(random, _models(), most=1_000_000), _read_model),
    "splats.ply": (lambda random: mutated_bytes(random, _splats(), most=300_000), _read_splats),
}
"""The makers of inputs and the readers, by name."""
