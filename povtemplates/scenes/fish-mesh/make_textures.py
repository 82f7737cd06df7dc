"""Make the textures of the fish scene in meshes.

The script needs NumPy, Pillow and the scene `fish` beside this folder, whose fish has the same colours. It writes to
its own folder, and the files are the same every time:

    python make_textures.py
"""

import shutil
from pathlib import Path

import numpy as np
from PIL import Image

HERE = Path(__file__).resolve().parent
SKY_HEIGHTS = -0.02, 0.6  # of the wall with the sky, in distances


def noise(shape, cells, rng):
    """Smooth noise in 0..1 that repeats at the edges."""
    values = rng.random(cells)
    y, x = (np.arange(size) / size * count for size, count in zip(shape, cells, strict=True))
    iy, ix = y.astype(int), x.astype(int)
    fy, fx = ((part - np.floor(part)) for part in (y, x))
    fy, fx = (fy * fy * (3 - 2 * fy))[:, None], (fx * fx * (3 - 2 * fx))[None, :]
    jy, jx = (iy + 1) % cells[0], (ix + 1) % cells[1]
    top = values[np.ix_(iy, ix)] * (1 - fx) + values[np.ix_(iy, jx)] * fx
    return top * (1 - fy) + (values[np.ix_(jy, ix)] * (1 - fx) + values[np.ix_(jy, jx)] * fx) * fy


def write_png(name, picture):
    """Write sRGB values 0..1 as an 8-bit PNG."""
    codes = np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8)
    Image.fromarray(codes).save(HERE / "textures" / name, optimize=True)


def gradient(value, *stops):
    """Colours between stops of a value and an sRGB colour; they are mixed in linear light."""
    places, colours = [place for place, _ in stops], np.array([colour for _, colour in stops]) ** 2.2
    return np.stack([np.interp(value, places, channel) for channel in colours.T], axis=-1) ** (1 / 2.2)


def sky(rng):
    """The sky as a wall that spans SKY_HEIGHTS of its distance in height, and the same in width."""
    rows, cols = 448, 320
    height = np.linspace(SKY_HEIGHTS[1], SKY_HEIGHTS[0], rows)
    upward = height / np.hypot(height, 1)
    rgb = gradient(
        upward[:, None] + np.zeros((1, cols)),
        *(
            (0, (1.00, 0.80, 0.56)),
            (0.020, (0.99, 0.84, 0.68)),
            (0.050, (0.72, 0.84, 0.86)),
            (0.090, (0.36, 0.66, 0.86)),
        ),
        *((0.150, (0.10, 0.36, 0.70)), (0.300, (0.03, 0.14, 0.42)), (1.000, (0.01, 0.05, 0.22))),
    )
    cloud = sum(noise((rows, cols), (28 * 2**k, 5 * 2**k), rng) / 2**k for k in range(3)) / 1.75
    cover = np.clip((cloud - 0.52) / 0.3, 0, 1) * 0.6 * np.clip((upward - 0.01) / 0.03, 0, 1)[:, None]
    return rgb + (np.array([1.0, 0.95, 0.88]) - rgb) * cover[..., None]


def main():
    (HERE / "textures").mkdir(exist_ok=True)
    of_fish = HERE.parent / "fish" / "textures"
    shutil.copyfile(of_fish / "skin.png", HERE / "textures" / "skin.png")
    for name, size in (("fin.png", (384, 192)), ("eye.png", (128, 128))):
        picture = Image.open(of_fish / name).convert("RGB").resize(size)
        picture.save(HERE / "textures" / name, optimize=True)
    rng = np.random.default_rng(1908)
    write_png("sky.png", np.round(sky(rng) * 100) / 100)
    stem = noise((128, 32), (6, 8), rng)
    write_png("stem.png", gradient(stem, (0, (0.30, 0.42, 0.10)), (0.6, (0.48, 0.60, 0.16)), (1, (0.72, 0.74, 0.30))))
    grain = 0.5 * noise((64, 96), (16, 24), rng) + 0.5 * noise((64, 96), (32, 48), rng)
    write_png("head.png", gradient(grain, (0.2, (0.20, 0.08, 0.03)), (0.8, (0.58, 0.30, 0.13))))
    vein = np.abs((np.arange(256) / 32) % 1 * 2 - 1)[:, None] + np.zeros((1, 8))
    write_png("leaf.png", gradient(vein, (0, (0.24, 0.44, 0.11)), (1, (0.44, 0.68, 0.20))))


if __name__ == "__main__":
    main()
