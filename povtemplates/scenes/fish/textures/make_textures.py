"""Draw the textures of the fish scene.

The script needs NumPy and OpenImageIO, and runs in any folder:

    python make_textures.py

It writes these files to its own folder. The seed is fixed, so the files are the same every time:

    skin.png    768x384  sRGB   one flank: u = snout..tail root, v = belly..back
    scales.png  768x384  grey   height of the same flank (scales, gill cover)
    fin.png      512x256 sRGBA  a fin: u = along its root, v = root..margin
    eye.png      256x256 sRGB   the iris, seen from the front

Both flanks of the fish use the same picture. v = 0 is the bottom row of a
picture, as in POV-Ray's uv mapping.
"""

from pathlib import Path

import numpy as np
import OpenImageIO

HERE = Path(__file__).resolve().parent
LENGTH_MM = 155.0  # of the body, so the skin can be laid out in millimetres
GIRTH_MM = 100.0  # from belly to back over the thickest part

ORANGE = np.array([1.00, 0.40, 0.02])
CRIMSON = np.array([0.80, 0.10, 0.03])
GOLD = np.array([1.00, 0.70, 0.10])
YELLOW = np.array([1.00, 0.74, 0.00])
WHITE = np.array([0.97, 0.98, 1.00])
AQUA = np.array([0.25, 0.78, 0.98])
NAVY = np.array([0.02, 0.04, 0.20])


def smooth(low, high, value):
    """0 below low, 1 above high, a smooth step between (low > high: falling)."""
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def mix(first, second, weight):
    """Blend two colours (or pictures) by a weight per pixel."""
    return first + (second - first) * weight[..., None]


def noise(shape, cells, rng):
    """Smooth noise in 0..1: random values on a coarse lattice, interpolated."""
    rows, cols = cells
    grid = rng.random((rows + 2, cols + 2))
    y = np.linspace(0, rows, shape[0])
    x = np.linspace(0, cols, shape[1])
    iy, ix = y.astype(int), x.astype(int)
    fy, fx = smooth(0, 1, y - iy)[:, None], smooth(0, 1, x - ix)[None, :]
    top = grid[np.ix_(iy, ix)] * (1 - fx) + grid[np.ix_(iy, ix + 1)] * fx
    low = grid[np.ix_(iy + 1, ix)] * (1 - fx) + grid[np.ix_(iy + 1, ix + 1)] * fx
    return top * (1 - fy) + low * fy


def unit_grid(width, height):
    """U to the right and v upwards, both 0..1 at the pixel centres."""
    u = (np.arange(width) + 0.5) / width
    v = 1.0 - (np.arange(height) + 0.5) / height
    return np.meshgrid(u, v)


def scale_pattern(x, y, size):
    """Overlapping round scales in staggered rows.

    Returns the height (0..1), the distance from the scale's centre (1 = rim)
    and a random-looking number per scale.  A scale overlaps the one behind it
    (towards the tail, +x), so the nearest to the snout wins.
    """
    height = np.zeros_like(x)
    radius = np.ones_like(x)
    tone = np.zeros_like(x)
    done = np.zeros(x.shape, bool)
    column = np.floor(x / size)
    for back in (2, 1, 0, -1):
        col = column - back
        shift = 0.5 * np.mod(col, 2.0)
        row = np.round(y / (size * 1.7) - shift)
        cx, cy = col * size, (row + shift) * size * 1.7
        r = np.hypot((x - cx) / 1.55, (y - cy) / 0.98) / size
        hit = (r < 1.0) & ~done
        height[hit] = (0.25 + 0.75 * (x - cx) / (1.6 * size))[hit]
        radius[hit] = r[hit]
        tone[hit] = np.mod(np.sin(col * 12.9898 + row * 78.233) * 43758.5453, 1.0)[hit]
        done |= hit
    return np.clip(height, 0.0, 1.0), radius, tone


def skin(rng):
    """The flank's colours and its height map."""
    width, height = 768, 384
    u, v = unit_grid(width, height)
    x = u * LENGTH_MM
    y = (v - 0.5) * GIRTH_MM
    wobble = noise((height, width), (6, 12), rng) - 0.5

    # Counter-shading: dark red back, orange flank, golden belly.
    shade = v + 0.10 * wobble
    rgb = mix(ORANGE, CRIMSON, 0.95 * smooth(0.60, 0.95, shade))
    rgb = mix(rgb, GOLD, smooth(0.48, 0.10, shade))
    rgb = mix(rgb, GOLD, 0.45 * smooth(24.0, 4.0, x) * smooth(0.9, 0.5, v))

    # Scales fade out over the head.
    bump, radius, tone = scale_pattern(x, y, 3.5)
    scaly = smooth(40.0, 52.0, x + 0.12 * y)
    rgb = mix(rgb, rgb * 0.50, scaly * smooth(0.70, 1.0, radius))
    rgb = rgb * (1.0 + scaly * (0.22 * tone - 0.09))[..., None]
    rgb = mix(rgb, np.array([1.0, 0.86, 0.45]), 0.26 * scaly * smooth(0.6, 0.1, radius))

    # Three bands: white inside, aqua towards the rims, outlined in navy.
    bands = ((46.0, 7.0, 0.0022), (91.0, 8.0, -0.0016), (136.0, 5.0, 0.0006))
    for centre, half, bow in bands:
        middle = centre - bow * (y + 4.0) ** 2 + 3.0 * wobble
        away = np.abs(x - middle) - half * (1.0 + 0.25 * np.sin(v * 5.0))
        rgb = mix(rgb, NAVY, smooth(3.2, 2.2, away))
        inner = mix(np.broadcast_to(AQUA, rgb.shape), WHITE, smooth(0.0, -3.5, away))
        inner = inner * (1.0 - 0.22 * scaly * smooth(0.75, 1.0, radius))[..., None]
        rgb = mix(rgb, inner, smooth(0.4, -0.4, away))

    # A blue eye stripe, cheek lines, the gill slit, and fine freckles.
    stripe = np.abs(x - 24.0 + 0.10 * (y - 4.0)) - 2.2
    rgb = mix(rgb, NAVY, 0.85 * smooth(1.6, 0.2, stripe) * smooth(0.30, 0.52, v))
    for radius_mm, strength in ((19.0, 0.75), (24.0, 0.6), (29.0, 0.45)):
        ring = np.abs(np.hypot(x - 14.0, (y + 2.0) * 1.0) - radius_mm - wobble * 3.0)
        where = smooth(0.47, 0.40, v) * smooth(0.08, 0.2, v)
        rgb = mix(rgb, AQUA, strength * smooth(1.3, 0.4, ring) * where)
    gill = x - 36.0 + 0.0060 * (y + 3.0) ** 2
    in_gill = smooth(0.14, 0.24, v) * smooth(0.72, 0.62, v)
    rgb = rgb * (1.0 - 0.55 * smooth(1.8, 0.2, np.abs(gill)) * in_gill)[..., None]

    relief = 0.45 + 0.35 * scaly * (bump - 0.5) * (1.0 - 0.5 * smooth(0.85, 1.0, radius))
    relief += 0.22 * smooth(1.5, -2.5, gill) * in_gill * (1.0 - scaly)
    return np.clip(rgb, 0, 1), np.clip(relief, 0, 1)


def fin(rng):
    """Fin rays from the root (v = 0) to the margin (v = 1), with alpha."""
    width, height = 512, 256
    u, v = unit_grid(width, height)
    rays = 26.0
    # Rays branch in two in the outer half of the fin.
    inner = np.abs(np.mod(u * rays, 1.0) - 0.5) * 2.0
    outer = np.abs(np.mod(u * rays * 2.0, 1.0) - 0.5) * 2.0
    ray = (1 - smooth(0.45, 0.65, v)) * smooth(0.35, 0.9, inner)
    ray += smooth(0.45, 0.65, v) * smooth(0.30, 0.9, outer)

    rgb = mix(np.broadcast_to(ORANGE, (height, width, 3)), YELLOW, smooth(0.15, 0.70, v))
    rgb = mix(rgb, CRIMSON, 0.80 * ray * smooth(1.0, 0.2, v))
    edge = v + 0.025 * np.sin(u * 2 * np.pi * rays) + 0.05 * (noise((height, width), (2, 9), rng) - 0.5)
    rgb = mix(rgb, NAVY, smooth(0.72, 0.76, edge))
    rgb = mix(rgb, AQUA, smooth(0.87, 0.90, edge))
    rgb = mix(rgb, WHITE, 0.7 * smooth(0.94, 0.99, edge))

    alpha = 0.74 + 0.24 * ray
    alpha = np.maximum(alpha, smooth(0.35, 0.05, v))
    alpha = np.maximum(alpha, 0.93 * smooth(0.70, 0.76, edge))
    return np.dstack([np.clip(rgb, 0, 1), np.clip(alpha, 0, 1)])


def eye(rng):
    """Black pupil, fibrous golden iris, dark limbus ring."""
    size = 256
    u, v = unit_grid(size, size)
    dx, dy = u - 0.5, v - 0.5
    r = np.hypot(dx, dy) * 2.0
    angle = np.arctan2(dy, dx)
    polar = noise((64, 512), (3, 90), rng)
    fibre = polar[np.clip(r * 63, 0, 63).astype(int), ((angle / (2 * np.pi) + 0.5) * 511).astype(int)]
    iris = mix(np.array([0.95, 0.45, 0.03]), np.array([1.00, 0.90, 0.35]), fibre)
    iris = mix(iris, np.array([0.75, 0.12, 0.02]), smooth(0.66, 0.84, r))
    rgb = mix(iris, np.array([1.00, 0.95, 0.70]), smooth(0.53, 0.49, r))
    rgb = mix(rgb, np.array([0.004, 0.004, 0.010]), smooth(0.485, 0.455, r))
    rgb = mix(rgb, NAVY * 0.5, smooth(0.84, 0.92, r))
    return np.clip(rgb, 0, 1)


def write(name, picture):
    """Write values 0..1 (already sRGB encoded) as an 8-bit PNG."""
    data = np.ascontiguousarray(np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8))
    if data.ndim == 2:
        data = data[..., None]
    spec = OpenImageIO.ImageSpec(data.shape[1], data.shape[0], data.shape[2], "uint8")
    spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("png:compressionLevel", 9)
    spec.attribute("png:filter", 8)  # none: the smallest for few levels
    path = HERE / name
    out = OpenImageIO.ImageOutput.create(str(path))
    if not (out and out.open(str(path), spec) and out.write_image(data)):
        raise SystemExit(f"cannot write {path}: {OpenImageIO.geterror()}")
    out.close()


def main():
    rng = np.random.default_rng(1908)
    rgb, relief = skin(rng)
    # Fewer grey levels compress far better and do not show on the moving fish.
    write("skin.png", np.round(rgb * 31) / 31)
    write("scales.png", np.round(relief * 63) / 63)
    write("fin.png", np.round(fin(rng) * 51) / 51)
    write("eye.png", eye(rng))


if __name__ == "__main__":
    main()
