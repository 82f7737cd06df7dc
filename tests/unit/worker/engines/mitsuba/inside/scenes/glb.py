"""Small glTF files for tests, made here."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

_TYPES = {"float32": 5126, "uint16": 5123, "uint32": 5125, "uint8": 5121}


class Glb:
    """A glTF document that grows, with one buffer."""

    def __init__(self) -> None:
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {}}]}],
            "accessors": [],
            "bufferViews": [],
        }
        self.binary = b""

    @property
    def primitive(self) -> dict[str, Any]:
        primitive: dict[str, Any] = self.document["meshes"][0]["primitives"][0]
        return primitive

    def view(self, data: bytes) -> int:
        """Add a buffer view, and return its number."""
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.document["bufferViews"].append(view)
        self.binary += data + b"\0" * (-len(data) % 4)
        return len(self.document["bufferViews"]) - 1

    def accessor(self, values: ArrayLike, dtype: str = "float32") -> int:
        """Add an accessor of values, shape (count,) or (count, width), and return its number."""
        array = np.asarray(values, dtype=dtype)
        kind = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}[array.shape[1] if array.ndim > 1 else 1]
        entry = {"bufferView": self.view(array.tobytes()), "componentType": _TYPES[dtype], "type": kind}
        self.document["accessors"].append(entry | {"count": len(array)})
        return len(self.document["accessors"]) - 1

    def data(self) -> bytes:
        """Return the .glb."""
        self.document["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(self.binary), 0x4E4942)
        body = chunks + self.binary
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def square() -> Glb:
    """Return a file with a square of two triangles, from -1 to 1, that looks along z."""
    glb = Glb()
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    number = glb.accessor(corners)
    glb.document["accessors"][number] |= {"min": [-1, -1, 0], "max": [1, 1, 0]}
    glb.primitive["attributes"]["POSITION"] = number
    glb.primitive["attributes"]["TEXCOORD_0"] = glb.accessor([(0, 1), (1, 1), (1, 0), (0, 0)])
    glb.primitive["indices"] = glb.accessor([0, 1, 2, 0, 2, 3], "uint16")
    return glb
