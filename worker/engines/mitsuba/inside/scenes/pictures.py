"""Textures: the size in a picture's header is checked before anything of it is decoded."""

from __future__ import annotations

import io
import warnings
from typing import Any

import mitsuba
import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from worker.engines.mitsuba.inside.scenes.loaded import SceneFiles

mi: Any = mitsuba
"""Without types, because those of the stubs are not those of a variant."""

MAX_TEXTURE_PX = 8192 * 8192
MAX_ALL_TEXTURES_PX = 4 * MAX_TEXTURE_PX
_BRIGHTEST_HALF = 1000.0
"""The factor above which colours are kept as 32-bit floats."""
_FORMATS = ("PNG", "JPEG", "WEBP")

_CODES = np.arange(256) / 255.0
LINEAR = np.where(_CODES <= 0.04045, _CODES / 12.92, ((_CODES + 0.055) / 1.055) ** 2.4)
"""The linear value of each 8-bit code of sRGB (IEC 61966-2-1)."""


def read_picture(data: bytes, files: SceneFiles, *, place: str) -> NDArray[np.uint8]:
    """Return the pixels of a PNG, JPEG or WebP, shape (row, col, 4), 8 bit RGBA.

    Raises
    ------
    SceneError
        If it is no such picture, is damaged, or has more pixels than a texture may have.
    """
    check_picture(data, files, place=place)
    try:
        with warnings.catch_warnings(), Image.open(io.BytesIO(data), formats=_FORMATS) as picture:
            warnings.simplefilter("ignore")
            return np.asarray(picture.convert("RGBA"))
    except (OSError, ValueError, SyntaxError) as error:
        raise files.refuse(place, "a picture that is whole", error) from error


def check_picture(data: bytes, files: SceneFiles, *, place: str) -> None:
    """Check the size that the header of a PNG, JPEG or WebP names, and count its pixels."""
    try:
        with warnings.catch_warnings(), Image.open(io.BytesIO(data), formats=_FORMATS) as picture:
            warnings.simplefilter("ignore")
            cols, rows = picture.size
    except (UnidentifiedImageError, Image.DecompressionBombError, OSError, ValueError, SyntaxError) as error:
        raise files.refuse(
            place, f"a texture of {', '.join(_FORMATS)}, at most {MAX_TEXTURE_PX:,} px", error
        ) from error
    count_pixels(cols, rows, files, place=place)


def count_pixels(cols: int, rows: int, files: SceneFiles, *, place: str) -> None:
    """Refuse a texture that is too large, or too many of them."""
    files.texture_px += cols * rows
    if cols * rows > MAX_TEXTURE_PX:
        raise files.refuse(place, f"a texture of at most {MAX_TEXTURE_PX:,} px", f"{cols} x {rows}")
    if files.texture_px > MAX_ALL_TEXTURES_PX:
        raise files.refuse(place, f"at most {MAX_ALL_TEXTURES_PX:,} px in all textures", f"{files.texture_px:,}")


def colour_texture(pixels: NDArray[np.uint8], factor: tuple[float, float, float]) -> dict[str, Any]:
    """Return the texture of the colours of a picture times a factor, in linear light."""
    if factor == (1.0, 1.0, 1.0):
        bitmap = mi.Bitmap(np.ascontiguousarray(pixels[..., :3]))
        return {"type": "bitmap", "bitmap": bitmap, "raw": False}
    dtype = np.float16 if max(factor) <= _BRIGHTEST_HALF else np.float32
    linear = np.empty((*pixels.shape[:2], 3), dtype=dtype)
    for channel, share in enumerate(factor):
        linear[..., channel] = (LINEAR * share).astype(dtype)[pixels[..., channel]]
    return {"type": "bitmap", "bitmap": mi.Bitmap(linear), "raw": True}


def data_texture(values: NDArray[np.floating[Any]]) -> dict[str, Any]:
    """Return the texture of numbers, shape (row, col) or (row, col, 3)."""
    shaped = values if values.ndim == 3 else values[..., np.newaxis]
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(shaped, dtype=np.float16)),
        "raw": True,
    }
