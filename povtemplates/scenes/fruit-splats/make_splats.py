"""Make fruit.ply, the Gaussian splats of a bowl of fruit: `python make_splats.py`.

Points lie evenly on the surfaces of ellipsoids, a bowl, a table and a wall. Each becomes a flat Gaussian in its tangent
plane. Its colour is the light of a lamp and of the sky there, and harmonics of degree 1 follow the gloss. The file has
the layout of 3D Gaussian Splatting, with y downwards as trained files have, in decimetres.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

COUNT = 10_500
LAMP = np.array([-3.0, 5.0, -4.0])
"""The lamp, with y upwards and z away from the rig."""
SKY, SUN, GLOSS = 0.35, 0.75, 0.55
SH_0, SH_1 = 0.28209479177387814, 0.4886025119029199
_GOLDEN = np.pi * (3 - 5**0.5)


@dataclass(frozen=True)
class Fruit:
    """An ellipsoid of revolution that lies turned about z."""

    center: tuple[float, float, float]
    radius: float
    length: float
    tilt_deg: float
    colour: tuple[float, float, float]
    blush: tuple[float, float, float]

    @property
    def axes(self) -> Array:
        """The own axes as columns, (3, 3); y is the axis of revolution."""
        turn = np.radians(self.tilt_deg)
        return np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])

    @property
    def radii(self) -> Array:
        """The radii along the own axes."""
        return np.array([self.radius, self.length, self.radius])


FRUITS = (
    Fruit((-0.52, 0.62, 0.10), 0.40, 0.38, 10, (0.95, 0.50, 0.08), (0.98, 0.62, 0.15)),
    Fruit((0.30, 0.60, -0.15), 0.38, 0.36, -15, (0.75, 0.10, 0.10), (0.85, 0.70, 0.20)),
    Fruit((0.05, 0.62, 0.55), 0.40, 0.39, 0, (0.50, 0.70, 0.15), (0.75, 0.75, 0.25)),
    Fruit((0.75, 0.62, 0.45), 0.36, 0.35, 20, (0.95, 0.48, 0.08), (0.98, 0.60, 0.12)),
    Fruit((-0.10, 0.98, 0.15), 0.27, 0.38, 65, (0.97, 0.85, 0.20), (0.90, 0.88, 0.30)),
    Fruit((1.05, 0.20, -1.10), 0.20, 0.20, 0, (0.45, 0.12, 0.35), (0.60, 0.20, 0.45)),
    Fruit((0.72, 0.19, -1.30), 0.19, 0.19, 0, (0.40, 0.10, 0.30), (0.55, 0.18, 0.40)),
    Fruit((-1.15, 0.28, -0.95), 0.26, 0.36, 80, (0.98, 0.86, 0.22), (0.85, 0.85, 0.30)),
)


def main() -> None:
    """Write fruit.ply beside this file."""
    parts = [*(_fruit(fruit, _share(fruit)) for fruit in FRUITS), _bowl(2500), _table(2300), _wall(500)]
    points, normals, colours, spacing = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    write(Path(__file__).parent / "fruit.ply", points, normals, *_lit(points, normals, colours), spacing)


def _share(fruit: Fruit) -> int:
    area = fruit.radius * (fruit.radius + 2 * fruit.length) / 3
    whole = sum(other.radius * (other.radius + 2 * other.length) / 3 for other in FRUITS)
    return round((COUNT - 5300) * area / whole)


def _fruit(fruit: Fruit, count: int) -> tuple[Array, Array, Array, Array]:
    """Return points, outward normals, colours and spacings on a fruit."""
    index = np.arange(count) + 0.5
    height, turn = 1 - 2 * index / count, _GOLDEN * index
    ring = np.sqrt(1 - height**2)
    unit = np.stack([ring * np.cos(turn), height, ring * np.sin(turn)], axis=1)
    points = unit * fruit.radii @ fruit.axes.T + fruit.center
    normals = unit / fruit.radii @ fruit.axes.T
    share = 0.5 + 0.5 * height[:, None]
    colours = (1 - share) * fruit.colour + share * np.array(fruit.blush)
    area = 4 * np.pi * (fruit.radius**1.6 * (fruit.radius**1.6 + 2 * fruit.length**1.6) / 3) ** (1 / 1.6)
    stem = np.linalg.norm(unit - [0, 1, 0], axis=1) < 0.18
    colours[stem] = 0.25 * colours[stem] + [0.12, 0.08, 0.03]
    return points, _unit(normals), colours, np.full(count, np.sqrt(area / count))


def _bowl(count: int) -> tuple[Array, Array, Array, Array]:
    """Return a bowl: a paraboloid from its foot to its rim, white with a blue rim and blue rays."""
    index = np.arange(count) + 0.5
    radius, turn = 1.25 * np.sqrt(index / count), _GOLDEN * index
    height = 0.06 + 0.42 * (radius / 1.25) ** 2.5
    slope = 0.42 * 2.5 / 1.25 * (radius / 1.25) ** 1.5
    points = np.stack([radius * np.cos(turn), height, radius * np.sin(turn) + 0.25], axis=1)
    normals = _unit(np.stack([-slope * np.cos(turn), np.ones(count), -slope * np.sin(turn)], axis=1))
    blue = (np.abs(radius - 1.19) < 0.03) | (np.abs(np.sin(9 * turn)) > 0.96) & (radius > 0.8)
    colours = np.where(blue[:, None], [0.12, 0.25, 0.62], [0.86, 0.87, 0.88])
    return points, normals, colours, np.sqrt(np.pi * 1.25**2 / count * np.sqrt(1 + slope**2))


def _table(count: int) -> tuple[Array, Array, Array, Array]:
    """Return a round table with a cloth of squares."""
    index = np.arange(count) + 0.5
    radius, turn = 2.6 * np.sqrt(index / count), _GOLDEN * index
    points = np.stack([radius * np.cos(turn), np.zeros(count), radius * np.sin(turn) + 0.25], axis=1)
    square = (np.floor(points[:, 0] / 0.4) + np.floor(points[:, 2] / 0.4)) % 2
    colours = np.where(square[:, None] > 0, [0.70, 0.22, 0.18], [0.88, 0.82, 0.70])
    return points, np.tile([0.0, 1, 0], (count, 1)), colours, np.full(count, np.sqrt(np.pi * 2.6**2 / count))


def _wall(count: int) -> tuple[Array, Array, Array, Array]:
    """Return a wall behind the table that shades from warm to cool."""
    index = np.arange(count) + 0.5
    across, up = index * 0.7548776662466927 % 1, index * 0.5698402909980532 % 1
    points = np.stack([9 * (across - 0.5), 8 * up - 4.5, np.full(count, 4.0)], axis=1)
    colours = (1 - up[:, None]) * [0.80, 0.70, 0.62] + up[:, None] * [0.42, 0.52, 0.66]
    return points, np.tile([0.0, 0, -1], (count, 1)), colours, np.full(count, 1.25 * np.sqrt(9 * 8 / count))


def _lit(points: Array, normals: Array, colours: Array) -> tuple[Array, Array]:
    """Return the colours as a camera stores them, and their slopes by the direction of view, (splat, 3 axes)."""
    to_lamp = _unit(LAMP - points)
    facing = (to_lamp * normals).sum(axis=1)
    lit = np.where(facing > 0, ~_shadowed(points + 0.01 * normals, to_lamp), False) * np.clip(facing, 0, 1)
    near = np.exp(-3.0 * np.clip(points[:, 1], 0, 1))
    sky = SKY * (0.6 + 0.4 * normals[:, 1]) * (1 - 0.5 * near * (normals[:, 1] < 0.5))
    linear = colours**2.2 * (sky + SUN * lit)[:, None]
    stored = np.clip(linear, 0, 1) ** (1 / 2.2)
    mirrored = 2 * facing[:, None] * normals - to_lamp
    # The gloss grows as the line of sight meets the mirrored ray: the direction of view points away from the eye.
    gloss = 0.12 * GLOSS * lit[:, None]
    return stored + 0.3 * gloss, -mirrored * gloss


def _shadowed(points: Array, towards: Array) -> NDArray[np.bool_]:
    """Return whether a fruit is between points and the lamp."""
    hidden = np.zeros(len(points), bool)
    for fruit in FRUITS:
        start = (points - fruit.center) @ fruit.axes / fruit.radii
        way = towards @ fruit.axes / fruit.radii
        a, b, c = (way**2).sum(1), (start * way).sum(1), (start**2).sum(1) - 1
        hidden |= (b * b - a * c > 0) & (b < 0) & (c > 0)
    return hidden


def write(path: Path, points: Array, normals: Array, stored: Array, slopes: Array, spacing: Array) -> None:
    """Write flat Gaussians with y downwards: a turn by 180 degrees about z, which keeps right-handed axes."""
    turned = np.array([-1.0, -1, 1])
    points, normals, slopes = points * turned, normals * turned, slopes * turned
    sigma = 0.62 * spacing[:, None] * np.array([1, 1, 0.08])
    rest = np.tile((slopes * [-1, 1, -1])[:, [1, 2, 0]] / SH_1, (1, 3))
    logit = np.full((len(points), 1), np.log(0.96 / 0.04))
    columns = [points, (stored - 0.5) / SH_0, rest, logit, np.log(sigma), _from_z(normals)]
    names = ["x", "y", "z", *(f"f_dc_{i}" for i in range(3)), *(f"f_rest_{i}" for i in range(9)), "opacity"]
    names += [*(f"scale_{i}" for i in range(3)), *(f"rot_{i}" for i in range(4))]
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    head += [*(f"property float {name}" for name in names), "end_header", ""]
    table = np.concatenate(columns, axis=1).astype("<f4").view("<u4")
    # 12 bits of a fraction are enough, and an archive of them is a third as large.
    table = (table + 0x400) & 0xFFFFF800
    path.write_bytes("\n".join(head).encode() + table.astype("<u4").tobytes())


def _from_z(normals: Array) -> Array:
    """Return quaternions, w first, that turn z to the normals."""
    half = np.concatenate([1 + normals[:, 2:], -normals[:, 1:2], normals[:, :1], np.zeros((len(normals), 1))], axis=1)
    half[half[:, 0] < 1e-6] = [0, 1, 0, 0]
    return _unit(half)


def _unit(vectors: Array) -> Array:
    scaled: Array = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return scaled


if __name__ == "__main__":
    main()
