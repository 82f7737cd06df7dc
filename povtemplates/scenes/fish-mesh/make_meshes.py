"""Make the meshes of the fish scene in meshes.

The script needs NumPy and SciPy. It writes to its own folder, and the files are the same every time:

    python make_meshes.py

One unit is 1 mm. The axes are right-handed: those of the scene `fish` with z turned round, so that the lens looks along
-z. The shapes follow the text of that scene. Meshes are binary PLY with normals and texture coordinates.
"""

from pathlib import Path

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

HERE = Path(__file__).resolve().parent
FISH_LENGTH = 204.0
BODY_LENGTH = 155.0
# Each stem: x, z, radius, start and length of its head, tilt in degrees, and its leaves. Each leaf: height, reach,
# droop, half width, x.
STEMS = (
    (158, 375, 5.5, 124, 78, 2.0, ((240, 66, 60, 8, 3), (180, -46, 20, 8, -3))),
    (-196, 750, 7.5, 182, 96, -2.0, ((250, -92, 60, 11, 0), (300, 60, 40, 11, 0))),
    (132, 1125, 9.5, 240, 112, -1.5, ((330, 92, 80, 13, 0), (290, -70, 30, 13, 0))),
    (-96, 1500, 11.5, 300, 124, 1.5, ((360, -140, 110, 15, 0), (330, 80, 40, 15, 0))),
)
ENTRANCE_PUPIL_Z = -1056.56
SKY_Z = 60000.0


def grid(points, u=None, v=None):
    """A mesh over points `(rows, cols, 3)`: vertices, normals, texture coordinates and faces.

    Vertices of equal positions get one normal, so that closed rings and poles are smooth.
    """
    rows, cols, _ = points.shape
    u = np.linspace(0, 1, rows)[:, None] if u is None else u
    v = np.linspace(0, 1, cols)[None, :] if v is None else v
    uv = np.stack(np.broadcast_arrays(u, v), axis=-1).reshape(-1, 2)
    first = (np.arange(rows - 1)[:, None] * cols + np.arange(cols - 1)).reshape(-1)
    faces = np.concatenate(
        [
            np.stack([first, first + 1, first + cols], axis=-1),
            np.stack([first + 1, first + cols + 1, first + cols], axis=-1),
        ]
    )
    vertices = points.reshape(-1, 3)
    corners = vertices[faces]
    weighted = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    keep = np.linalg.norm(weighted, axis=1) > 1e-9
    faces, weighted = faces[keep], weighted[keep]
    _, place = np.unique(np.round(vertices, 4), axis=0, return_inverse=True)
    place = place.reshape(-1)
    sums = np.zeros((place.max() + 1, 3))
    for corner in range(3):
        np.add.at(sums, place[faces[:, corner]], weighted)
    normals = sums[place]
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return vertices, normals, uv, faces


def joined(meshes):
    """One mesh of several."""
    offsets = np.cumsum([0] + [len(mesh[0]) for mesh in meshes])
    parts = [np.concatenate([mesh[i] for mesh in meshes]) for i in range(3)]
    faces = np.concatenate([mesh[3] + offset for mesh, offset in zip(meshes, offsets, strict=False)])
    return (*parts, faces)


def moved(mesh, matrix, shift):
    """A mesh turned or scaled about the origin, then shifted."""
    vertices, normals, uv, faces = mesh
    turned = normals @ np.linalg.inv(matrix)
    turned /= np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-12)
    if np.linalg.det(matrix) < 0:
        faces = faces[:, ::-1]
    return vertices @ matrix.T + np.asarray(shift, float), turned, uv, faces


def rotation(axis, degrees):
    """A turn about the axis 0, 1 or 2, as POV-Ray's rotate turns in left-handed axes."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, -s, s, c
    return matrix


def write_ply(name, mesh):
    """Write a mesh of left-handed axes in right-handed ones: z and the order of the corners turn round."""
    vertices, normals, uv, faces = mesh
    turn = np.array([1.0, 1.0, -1.0])
    columns = [vertices * turn, normals * turn] + ([] if uv is None else [uv[:, :1], 1 - uv[:, 1:]])
    table = np.concatenate(columns, axis=1).astype("<f4")
    corners = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    corners["count"], corners["corners"] = 3, faces[:, ::-1]
    names = "".join(
        f"property float {word}\n" for word in ("x", "y", "z", "nx", "ny", "nz", "u", "v")[: table.shape[1]]
    )
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(table)}\n{names}"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    (HERE / "meshes" / name).write_bytes(head.encode() + table.tobytes() + corners.tobytes())


def knots(table):
    """A spline over rows of t and values, whose first and last rows only give the slopes."""
    t, values = np.array([row[0] for row in table], float), np.array([row[1:] for row in table], float)
    slopes = (values[2:] - values[:-2]) / (t[2:] - t[:-2])[:, None]
    return CubicHermiteSpline(t[1:-1], values[1:-1], slopes)


def natural(*table):
    """A natural spline over pairs of t and a point."""
    return CubicSpline([t for t, _ in table], np.array([point for _, point in table], float), bc_type="natural")


OUTLINE = knots(  # t, then x, back and belly
    (
        (-0.08, 1.6, 1.5, -8.0),
        (0.00, 0.0, -3.5, -3.5),
        (0.08, 2.2, 4.0, -10.5),
        (0.16, 8.5, 13.0, -17.0),
        (0.26, 20.0, 25.0, -25.5),
        (0.38, 38.0, 36.5, -34.0),
        (0.50, 58.0, 42.5, -39.5),
        (0.62, 80.0, 41.0, -38.5),
        (0.74, 103.0, 32.0, -30.5),
        (0.85, 125.0, 20.5, -20.5),
        (0.93, 141.0, 14.0, -14.5),
        (1.00, 155.0, 13.0, -13.5),
        (1.10, 170.0, 14.5, -15.0),
    )
)
HALF_WIDTH = knots(
    (
        (-0.08, -6.0),
        (0.00, 0.0),
        (0.08, 6.5),
        (0.16, 11.5),
        (0.26, 16.5),
        (0.38, 20.5),
        (0.50, 22.0),
        (0.62, 20.5),
        (0.74, 16.0),
        (0.85, 10.0),
        (0.93, 6.0),
        (1.00, 2.5),
        (1.10, 0.0),
    )
)


def swing(x):
    """The sideways displacement of the middle line of the body."""
    return 17 * (np.maximum(x - 60, 0) / 145) ** 2 - 5 * (np.maximum(60 - x, 0) / 60) ** 2


def body():
    """The body without its fins."""
    t = np.linspace(0, 1, 45)
    turn = np.linspace(0, 2 * np.pi, 37)
    (x, back, belly), wide = (column[:, None] for column in OUTLINE(t).T), HALF_WIDTH(t)
    y = (back + belly) / 2 - (back - belly) / 2 * np.cos(turn)
    z = wide * np.sin(turn) * (1 - 0.13 * np.cos(turn) ** 2) + swing(x)
    u = np.clip(x / BODY_LENGTH, 0.002, 0.998)
    return grid(np.stack(np.broadcast_arrays(x, y, z), axis=-1), u=u, v=1 - np.abs(np.linspace(-1, 1, 37))[None, :])


def fin(root, margin, count, ruffle, waves):
    """A sheet from a root to a margin."""
    s, f = np.linspace(0, 1, count + 1)[:, None, None], np.linspace(0, 1, 9)[None, :, None]
    a, b = natural(*root)(s[:, 0, 0])[:, None], natural(*margin)(s[:, 0, 0])[:, None]
    points = a + (b - a) * f
    points[..., 2] += (swing(points[..., :1]) + ruffle * f * f * np.sin(2 * np.pi * waves * s))[..., 0]
    return grid(points)


def fins():
    """All fins."""
    dorsal = (
        ((0, (34, 30, 0)), (0.25, (58, 39, 0)), (0.55, (88, 35, 0)), (0.8, (116, 21, 0)), (1, (140, 11, 0))),
        (
            *((0, (38, 39, 0)), (0.16, (56, 60, 0)), (0.4, (86, 66, 0)), (0.65, (122, 57, 0))),
            *((0.82, (150, 40, 0)), (0.93, (149, 24, 0)), (1, (142, 13, 0))),
        ),
    )
    anal = (
        ((0, (88, -33, 0)), (0.5, (114, -22, 0)), (1, (140, -11, 0))),
        (
            *((0, (90, -38, 0)), (0.25, (106, -56, 0)), (0.5, (128, -57, 0))),
            *((0.75, (149, -44, 0)), (0.9, (149, -26, 0)), (1, (142, -13, 0))),
        ),
    )
    tail = (
        ((0, (149, 11.5, 0)), (0.5, (147, 0, 0)), (1, (149, -12, 0))),
        (
            *((0, (170, 31, 0)), (0.10, (190, 42, 0)), (0.18, (203, 41, 0)), (0.34, (194, 19, 0)), (0.5, (189, 0, 0))),
            *((0.66, (194, -19, 0)), (0.82, (203, -41, 0)), (0.90, (190, -42, 0)), (1, (170, -31, 0))),
        ),
    )
    found = [fin(*dorsal, 30, 2.0, 3), fin(*anal, 22, 1.8, 2), fin(*tail, 36, 2.5, 2)]
    for side in (-1, 1):
        pectoral = (
            ((0, (48, -2, 19 * side)), (0.5, (47, -8, 19 * side)), (1, (49, -14, 18.5 * side))),
            (
                *((0, (62, 9, 27 * side)), (0.2, (80, 7, 36 * side)), (0.45, (88, -8, 39 * side))),
                *((0.7, (80, -24, 37 * side)), (0.88, (66, -28, 31 * side)), (1, (54, -22, 24 * side))),
            ),
        )
        pelvic = (
            ((0, (50, -33, 7 * side)), (0.5, (57, -34, 7 * side)), (1, (65, -35, 6 * side))),
            (
                *((0, (56, -48, 11 * side)), (0.3, (70, -60, 17 * side)), (0.6, (84, -58, 18 * side))),
                *((0.85, (82, -50, 13 * side)), (1, (73, -41, 8 * side))),
            ),
        )
        found += [fin(*pectoral, 20, 1.2, 2), fin(*pelvic, 16, 1.0, 2)]
    return joined(found)


def lip(lift, radius):
    """A tube around the snout along the line of the mouth."""
    f = np.linspace(-1, 1, 21)
    x, _, _ = OUTLINE(0.135 * np.abs(f)).T
    side = np.where(f < 0, -1, 1) * (HALF_WIDTH(0.135 * np.abs(f))[:, 0] + 0.01)
    middle = np.stack([x - 0.4, -5.0 + 1.6 * f**2 + lift * (1 - 0.85 * f**2), side + swing(x)], axis=-1)
    out = np.stack([middle[:, 0] - 13, np.zeros(21), side], axis=-1)
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    turn = np.linspace(0, 2 * np.pi, 13)[None, :, None]
    r = (radius * (1 - 0.93 * f**2))[:, None, None]
    return grid(middle[:, None] + r * (out[:, None] * np.cos(turn) + np.array([0, 1, 0]) * np.sin(turn)))


def ball(radius, rows=16, cols=24):
    """A sphere about the origin; its texture is seen from -z."""
    polar, turn = np.linspace(0, np.pi, rows + 1)[:, None], np.linspace(0, 2 * np.pi, cols + 1)[None, :]
    away = np.broadcast_arrays(np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), -np.cos(polar))
    points = radius * np.stack(away, axis=-1)
    return grid(points, u=points[..., 0] / 16.4 + 0.5, v=points[..., 1] / 16.4 + 0.5)


def torus(major, minor, z):
    """A ring about the z axis."""
    a, b = np.linspace(0, 2 * np.pi, 33)[:, None], np.linspace(0, 2 * np.pi, 13)[None, :]
    away = major + minor * np.cos(b)
    return grid(np.stack(np.broadcast_arrays(away * np.cos(a), away * np.sin(a), z + minor * np.sin(b)), axis=-1))


def at_eyes(mesh):
    """A mesh at both eyes."""
    tilt = rotation(1, 17) @ rotation(0, 6)
    return joined(
        [moved(mesh, np.diag([1, 1, -side]) @ tilt, (24.5, 8.5, side * 11.6 + swing(24.5))) for side in (-1, 1)]
    )


def of_fish(mesh):
    """A mesh of the fish about the point in which it turns, in the size of the scene."""
    return moved(moved(mesh, 1.18 * np.eye(3), (-1.18 * FISH_LENGTH / 2, 0, 0)), rotation(2, -3), (0, 0, 0))


def turned_profile(profile, sides=18):
    """A surface of revolution about y from pairs of radius and height, from the top down."""
    r, y = np.array(profile, float).T
    turn = np.linspace(0, 2 * np.pi, sides + 1)[None, :]
    points = np.broadcast_arrays(r[:, None] * np.cos(turn), y[:, None], r[:, None] * np.sin(turn))
    v = np.linspace(0, 3, sides + 1)[None, :]
    return grid(np.stack(points, axis=-1), u=y[:, None] / 60.0, v=v)


def leaf(height, reach, droop, half_wide):
    """A leaf that starts at the origin and leans along x."""
    f, v = np.linspace(0, 1, 21)[:, None], np.linspace(-1, 1, 5)[None, :, None]
    q = np.concatenate([reach * (0.15 * f + 0.85 * f**2.4), height * f - droop * f**4, -0.10 * reach * f], axis=1)
    slope = [reach * (0.15 + 2.04 * f**1.4), height - 4 * droop * f**3, np.full_like(f, -0.10 * reach)]
    side = np.cross(np.concatenate(slope, axis=1), (0, 0, 1))
    side = side / np.linalg.norm(side, axis=1, keepdims=True) + (0, 0, 0.5)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    wide = (half_wide * (0.55 + 0.9 * f) * np.maximum(1 - f, 0.0001) ** 0.7 * 1.2)[:, None]
    return grid(q[:, None] + side[:, None] * wide * v + np.array([0, 0, 0.35]) * wide * np.abs(v))


def bulrushes():
    """The stems, heads and leaves of the four bulrushes, above the height 0 of the water."""
    stems, heads, leaves = [], [], []
    arc = np.linspace(0, np.pi / 2, 7)
    for x, z, r, start, length, tilt, blades in STEMS:
        end, wide = start + length, 1.9 * r
        cap = [(wide * np.sin(a), end - wide + wide * np.cos(a)) for a in arc]
        cup = [(wide * np.cos(a), start + wide - wide * np.sin(a)) for a in arc]
        spike = turned_profile([(0.15 * r, end + 8 * r), (0.45 * r, end - 2)], sides=8)
        place = (rotation(2, tilt), (x, 0, z))
        stems += [moved(mesh, *place) for mesh in (turned_profile([(0.75 * r, start), (r, -60)]), spike)]
        heads.append(moved(turned_profile(cap + cup), *place))
        leaves += [moved(moved(leaf(*blade[:4]), np.eye(3), (blade[4], 0, 0)), *place) for blade in blades]
    return joined(stems), joined(heads), joined(leaves)


def waves(x, z):
    """The height of the water, in units of the height of its rings: see the scene `fish`."""

    def ring(r, length, reach):
        return np.cos(2 * np.pi / length * r) * np.exp(-r / reach)

    height = (
        ring(np.sqrt(x**2 + z**2 + 400), 34, 170)
        + 0.45 * ring(np.hypot(x - 158, z - 375), 26, 70)
        + 0.55 * ring(np.hypot(x + 196, z - 750), 34, 110)
        + 0.60 * ring(np.hypot(x - 132, z - 1125), 42, 140)
        + 0.35 * np.sin(0.060 * x + 0.105 * z)
        + 0.25 * np.sin(-0.085 * x + 0.070 * z + 1.3)
        + 0.20 * np.sin(0.030 * x - 0.130 * z + 4.0)
    )
    return height / (1 + ((z + 900) / 1500) ** 2)


def water():
    """The water as a fan of what the lens sees, with rows that are denser near it; its waves have the height 1 mm.

    The normals are those of the waves themselves. Where the rows are farther apart than a quarter of a wave, it is
    plane.
    """
    ahead = np.concatenate([np.geomspace(360, 3200, 230), [4000, 6000, 12000, 40000, 400000]])[:, None]
    across = np.linspace(-0.22, 0.22, 61)[None, :]
    x, z = across * ahead + 0 * across, ahead + ENTRANCE_PUPIL_Z + 0 * across
    calm = np.clip((2900 - ahead) / 900, 0, 1)
    h = 1e-3
    height = calm * waves(x, z)
    dx, dz = (calm * (waves(x + h * a, z + h * b) - waves(x - h * a, z - h * b)) / (2 * h) for a, b in ((1, 0), (0, 1)))
    vertices, _, _, faces = grid(np.stack([x, height, z], axis=-1))
    normals = np.stack([-dx, np.ones_like(dx), -dz], axis=-1).reshape(-1, 3)
    return vertices, normals / np.linalg.norm(normals, axis=1, keepdims=True), None, faces[:, ::-1]


def sky():
    """A wall 60 m behind the fish, as high as make_textures.py says and as wide."""
    x, y = np.array([[-0.31], [0.31]]), np.array([[-0.02, 0.6]])
    points = np.stack(np.broadcast_arrays(SKY_Z * x, SKY_Z * y, SKY_Z), axis=-1)
    return grid(points)


def main():
    (HERE / "meshes").mkdir(exist_ok=True)
    write_ply("body.ply", of_fish(body()))
    write_ply("fins.ply", of_fish(fins()))
    write_ply("lips.ply", of_fish(joined([lip(2.3, 2.5), lip(-2.3, 2.6)])))
    write_ply("mouth.ply", of_fish(lip(0, 1.5)))
    write_ply("eyes.ply", of_fish(at_eyes(ball(8.6))))
    write_ply("eye-rings.ply", of_fish(at_eyes(torus(7.5, 1.5, -4.3))))
    for name, mesh in zip(("stems.ply", "heads.ply", "leaves.ply"), bulrushes(), strict=True):
        write_ply(name, mesh)
    write_ply("water.ply", water())
    write_ply("sky.ply", sky())


if __name__ == "__main__":
    main()
