"""Make the glTF file of the turning knot.

The script needs NumPy and Pillow. It writes to its own folder, and the file is the same every time:

    python make_model.py

It writes knot.glb: one unit is 1 m, y points upward, and the lens looks along -z. A trefoil knot with a texture turns
once in 1.8 s, 45 frames, over a plinth; two directional lights and a point light shine on it.
"""

import io
import json
import struct
from pathlib import Path

import numpy as np
from PIL import Image

HERE = Path(__file__).resolve().parent
SECONDS = 1.8
FLOAT, SHORT = 5126, 5123  # glTF's numbers of component types
ARRAY, INDICES = 34962, 34963  # and of buffer targets


class Model:
    """The parts of a GLB: what they say and the bytes that they name."""

    def __init__(self):
        self.data = b""
        self.views, self.accessors, self.meshes = [], [], []

    def view(self, data, **more):
        """Add bytes; return the number of their view."""
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more})
        self.data += data + bytes(-len(data) % 4)
        return len(self.views) - 1

    def accessor(self, values, kind, **more):
        """Add an array `(count, numbers)`; return the number of its accessor."""
        component = SHORT if values.dtype == np.uint16 else FLOAT
        bounds = {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
        view = self.view(values.tobytes(), **more)
        shape = {"componentType": component, "count": len(values), "type": kind}
        self.accessors.append({"bufferView": view, **shape, **bounds})
        return len(self.accessors) - 1

    def mesh(self, name, material, points, normals, uv):
        """Add a grid of points `(rows, cols, 3)`; return the number of its mesh."""
        rows, cols, _ = points.shape
        a = (np.arange(rows - 1)[:, None] * cols + np.arange(cols - 1)).ravel()
        faces = np.stack([a, a + 1, a + cols, a + 1, a + cols + 1, a + cols], axis=-1).reshape(-1, 1)
        attributes = {
            word: self.accessor(np.asarray(values, "<f4").reshape(-1, size), f"VEC{size}", target=ARRAY)
            for word, values, size in (("POSITION", points, 3), ("NORMAL", normals, 3), ("TEXCOORD_0", uv, 2))
        }
        indices = self.accessor(faces.astype("<u2"), "SCALAR", target=INDICES)
        primitive = {"attributes": attributes, "indices": indices, "material": material}
        self.meshes.append({"name": name, "primitives": [primitive]})
        return len(self.meshes) - 1


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def knot():
    """A trefoil tube about 0.2 m wide: points, normals, texture coordinates."""
    t, turn = np.linspace(0, 2 * np.pi, 289), np.linspace(0, 2 * np.pi, 29)

    def middle(t):
        away = 0.062 + 0.030 * np.cos(3 * t)
        return np.stack([away * np.cos(2 * t), away * np.sin(2 * t), 0.040 * np.sin(3 * t)], axis=-1)

    ahead = unit(middle(t + 1e-4) - middle(t - 1e-4))
    side = unit(np.cross(ahead, unit(middle(t) * (1, 1, 0))))
    up = np.cross(side, ahead)
    normals = side[:, None] * np.cos(turn)[None, :, None] + up[:, None] * np.sin(turn)[None, :, None]
    uv = np.stack(np.broadcast_arrays(t[:, None] / (2 * np.pi), turn[None, :] / (2 * np.pi)), axis=-1)
    return middle(t)[:, None] + 0.019 * normals, normals, uv


def plinth():
    """A round plinth below the knot, with a groove."""
    profile = np.array([(0.0, -0.104), (0.066, -0.104), (0.070, -0.108), (0.070, -0.118), (0.064, -0.122)])
    profile = np.concatenate([profile, [(0.064, -0.128), (0.078, -0.132), (0.078, -0.2)]])
    # Each piece of the profile has its own normals, so that the edges are sharp.
    pieces = np.stack([profile[:-1], profile[1:]], axis=1)
    slopes = pieces[:, 1] - pieces[:, 0]
    out = unit(np.stack([-slopes[:, 1], slopes[:, 0]], axis=-1)).repeat(2, axis=0)
    pairs, turn = pieces.reshape(-1, 2), np.linspace(0, 2 * np.pi, 65)
    c, s = np.cos(turn)[None, :], np.sin(turn)[None, :]
    points = np.stack(np.broadcast_arrays(pairs[:, :1] * s, pairs[:, 1:] + 0 * c, pairs[:, :1] * c), axis=-1)
    normals = np.stack(np.broadcast_arrays(out[:, :1] * s, out[:, 1:] + 0 * c, out[:, :1] * c), axis=-1)
    return points, normals, np.zeros((*points.shape[:2], 2))


def backdrop():
    """A curved wall 0.5 m behind the knot that runs into a floor."""
    arc = np.linspace(-np.pi / 2, 0, 13)
    z = np.concatenate([[0.6], -0.3 + 0.2 * np.sin(arc - np.pi / 2) - 0.0, [-0.5]])
    y = np.concatenate([[-0.2], 0.2 * np.sin(arc), [0.8]])
    z[1:-1], y[1:-1] = -0.3 - 0.2 * np.cos(arc), 0.2 * np.sin(arc)
    x = np.array([-0.8, 0.8])
    line = np.stack([y, z], axis=-1)
    slope = unit(np.gradient(line, axis=0))
    shape = (len(y), 2)
    points = np.stack([np.broadcast_to(part, shape) for part in (x[None], y[:, None], z[:, None])], axis=-1)
    parts = (0.0, -slope[:, 1:], slope[:, :1])
    normals = np.stack([np.broadcast_to(part, shape) for part in parts], axis=-1)
    return points, normals, np.zeros((*shape, 2))


def iridescence():
    """The texture of the knot: the colours of the spectrum along it, with fine dark rings, as a PNG."""
    u, v = np.meshgrid((np.arange(512) + 0.5) / 512, (np.arange(64) + 0.5) / 64)
    phase = 2 * np.pi * (3 * u + v)
    rgb = 0.52 + 0.42 * np.cos(phase[..., None] - 2 * np.pi * np.array([0, 1, 2]) / 3)
    ring = np.clip((np.cos(2 * np.pi * 36 * u) - 0.86) / 0.08, 0, 1)[..., None]
    codes = np.round((rgb * (1 - 0.75 * ring)) * 255).astype(np.uint8)
    data = io.BytesIO()
    Image.fromarray(codes).save(data, "PNG", optimize=True)
    return data.getvalue()


def facing(direction):
    """The quaternion that turns -z to a direction."""
    x, y, z = unit(np.array(direction, float))
    half = np.array([y, -x, 0.0, 1.0 - z])  # the cross product of -z and the direction, and 1 + their product
    return unit(half).tolist()


def material(name, colour, roughness, **more):
    factors = {"baseColorFactor": [*colour, 1.0], "metallicFactor": 0.0, "roughnessFactor": roughness, **more}
    return {"name": name, "pbrMetallicRoughness": factors}


def main():
    model = Model()
    turning = model.mesh("knot", 0, *knot())
    standing = [model.mesh("plinth", 1, *plinth()), model.mesh("backdrop", 2, *backdrop())]
    times = np.linspace(0, SECONDS, 9, dtype="<f4")[:, None]
    half = -np.linspace(0, np.pi, 9)  # clockwise as seen from above
    turns = np.stack([0 * half, np.sin(half), 0 * half, np.cos(half)], axis=-1).astype("<f4")
    sampler = {"input": model.accessor(times, "SCALAR"), "output": model.accessor(turns, "VEC4")}
    image = model.view(iridescence())
    lights = [
        {"type": "directional", "name": "key", "color": [1.0, 0.95, 0.86], "intensity": 2.6},
        {"type": "directional", "name": "fill", "color": [0.62, 0.76, 1.0], "intensity": 1.0},
        {"type": "point", "name": "rim", "color": [1.0, 0.72, 0.5], "intensity": 0.12},
    ]
    places = [{"rotation": facing((0.6, -0.9, -0.8))}, {"rotation": facing((-0.8, -0.25, -0.6))}]
    places += [{"translation": [-0.16, 0.22, -0.22]}]
    nodes = [{"name": "turning knot", "mesh": turning}] + [{"mesh": mesh} for mesh in standing]
    nodes += [
        {"name": light["name"], **place, "extensions": {"KHR_lights_punctual": {"light": number}}}
        for number, (light, place) in enumerate(zip(lights, places, strict=True))
    ]
    channel = {"sampler": 0, "target": {"node": 0, "path": "rotation"}}
    text = {
        "asset": {"version": "2.0", "generator": "make_model.py", "copyright": "MIT"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": lights}},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": model.meshes,
        "materials": [
            material("iridescent", (1, 1, 1), 0.32, baseColorTexture={"index": 0}),
            material("plinth", (0.20, 0.17, 0.15), 0.45),
            material("backdrop", (0.42, 0.44, 0.50), 0.9),
        ],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"magFilter": 9729, "minFilter": 9729, "wrapS": 10497, "wrapT": 10497}],
        "images": [{"bufferView": image, "mimeType": "image/png"}],
        "animations": [{"name": "turn", "channels": [channel], "samplers": [{**sampler, "interpolation": "LINEAR"}]}],
        "accessors": model.accessors,
        "bufferViews": model.views,
        "buffers": [{"byteLength": len(model.data)}],
    }
    head = json.dumps(text, separators=(",", ":")).encode()
    head += b" " * (-len(head) % 4)
    chunks = (
        struct.pack("<I4s", len(head), b"JSON") + head + struct.pack("<I4s", len(model.data), b"BIN\0") + model.data
    )
    (HERE / "knot.glb").write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


if __name__ == "__main__":
    main()
