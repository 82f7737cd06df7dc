"""Integral images of known lenses by plain geometry: rays through pinholes into a scene of textured planes.

Nothing here is shared with what finds the lenses, but for `LensGrid`, which holds the geometry.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lippmann.lightfield.sheet.lens_grid import LensGrid
from tests.srgb import encoded_srgb, linear_of
from tests.unit.lippmann.lightfield.sheets import ROW_PITCH

FINE = 2
"""Rays a pixel, in each direction."""

DETAIL = 12.0
"""The pixels of a texture that a cell shows."""

TEXTURE_PX = 512
"""The side of a texture, which repeats."""


@dataclass(frozen=True)
class Plane:
    """A textured plane, as large as some discs of it are."""

    depth: float
    """The distance from the lenses by their focal length; positive in front of them."""
    share: float
    """How much of the picture it covers; 1 for a background."""


NEAR_AND_FAR = (Plane(-9.0, 1.0), Plane(-5.0, 0.4), Plane(4.0, 0.25), Plane(7.0, 0.1))
"""A background with things behind the array and in front of it."""

FAR = (Plane(-30.0, 1.0), Plane(-14.0, 0.5))
"""A scene all behind the array."""


def integral_image(
    grid: LensGrid, size: tuple[int, int], planes: tuple[Plane, ...] = NEAR_AND_FAR, *, seed: int = 0
) -> NDArray[np.uint8]:
    """Return the sRGB codes of the integral image that an endless lattice shows, `(rows, cols, 3)`."""
    rng = np.random.default_rng(seed)
    lens_x, lens_y, right, down = _lenses(grid, size)
    light = np.zeros((*lens_x.shape, 3), dtype=np.float32)
    for plane in planes:
        x, y = lens_x - plane.depth * right, lens_y - plane.depth * down
        scale = DETAIL / abs(plane.depth)
        texture = _texture(rng)
        shown = _at(texture, scale * x / grid.pitch_px, scale * y / grid.pitch_px)
        where = _at(_texture(rng)[..., :1], scale * x / grid.pitch_px / 3, scale * y / grid.pitch_px / 3)
        there = where <= np.quantile(where, plane.share)
        light = np.where(there, shown, light)
    pixels = light.reshape(size[0], FINE, size[1], FINE, 3).mean(axis=(1, 3))
    codes: NDArray[np.uint8] = np.rint(255 * encoded_srgb(pixels)).astype(np.uint8)
    return codes


def photograph(size: tuple[int, int], *, seed: int = 0) -> NDArray[np.uint8]:
    """Return the sRGB codes of a picture without lenses, `(rows, cols, 3)`."""
    down, right = np.mgrid[: size[0], : size[1]] / 1.5
    shown = _at(_texture(np.random.default_rng(seed)), right, down)
    codes: NDArray[np.uint8] = np.rint(255 * encoded_srgb(shown)).astype(np.uint8)
    return codes


def through_jpeg(codes: NDArray[np.uint8], quality: int, *, subsampling: str = "4:2:0") -> NDArray[np.uint8]:
    """Return codes `(rows, cols, 3)` as they come back from a JPEG."""
    held = BytesIO()
    Image.fromarray(codes).save(held, "JPEG", quality=quality, subsampling=subsampling)
    return np.asarray(Image.open(held).convert("RGB"))


def light_of(codes: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the linear light of sRGB codes."""
    light: NDArray[np.float32] = linear_of(codes / 255).astype(np.float32)
    return light


def _texture(rng: np.random.Generator) -> NDArray[np.float32]:
    """Return a texture of 0.05 to 1 like that of nature: amplitudes fall with the frequency."""
    fx, fy = np.fft.fftfreq(TEXTURE_PX), np.fft.fftfreq(TEXTURE_PX)[:, np.newaxis]
    fall = 1 / np.maximum(np.hypot(fx, fy), 1 / TEXTURE_PX) ** 1.2
    noise = np.fft.fft2(rng.normal(size=(3, TEXTURE_PX, TEXTURE_PX))) * fall
    field = np.moveaxis(np.fft.ifft2(noise).real, 0, -1)
    field = field.mean(axis=2, keepdims=True) * 1.5 + field / 2  # mostly grey, as things are
    low, high = np.quantile(field, (0.02, 0.98))
    texture: NDArray[np.float32] = (0.03 + 0.97 * np.clip((field - low) / (high - low), 0, 1) ** 2).astype(np.float32)
    return texture


def _at(texture: NDArray[np.float32], x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float32]:
    from scipy.ndimage import map_coordinates

    planes = [map_coordinates(texture[..., c], (y, x), order=1, mode="grid-wrap") for c in range(texture.shape[2])]
    return np.stack(planes, axis=-1)


def _lenses(grid: LensGrid, size: tuple[int, int]) -> tuple[NDArray[np.float64], ...]:
    """Return for fine places their lens's centre (x, y) and the place (right, down) from it, px along the lattice."""
    down, right = ((np.arange(side * FINE) + 0.5) / FINE - at for side, at in zip(size, grid.offset_px, strict=True))
    turn = math.radians(grid.turn_deg)
    x = right * math.cos(turn) + down[:, np.newaxis] * math.sin(turn)
    y = down[:, np.newaxis] * math.cos(turn) - right * math.sin(turn)
    if grid.lattice == "square":
        lens_x, lens_y = (np.round(at / grid.pitch_px) * grid.pitch_px for at in (x, y))
        return lens_x, lens_y, x - lens_x, y - lens_y
    found: list[NDArray[np.float64]] = []
    for step in (0, 1):
        row = np.floor(y / (grid.pitch_px * ROW_PITCH)) + step
        shift = np.where(row % 2 == 0, 0.0, 0.5)
        lens_x = (np.round(x / grid.pitch_px - shift) + shift) * grid.pitch_px
        lens_y = row * grid.pitch_px * ROW_PITCH
        one = np.stack((lens_x, lens_y, x - lens_x, y - lens_y))
        if found:
            nearer = np.hypot(one[2], one[3]) < np.hypot(found[0][2], found[0][3])
            one = np.where(nearer, one, found[0])
        found = [one]
    return tuple(found[0])
