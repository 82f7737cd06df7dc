"""Linear EXR masters; sRGB PNG, TIFF and WebP for people."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import OutputError
from worker.images.bands.png import write_png_bands
from worker.images.bands.rows import write_rows
from worker.images.bands.tiff import write_tiff_bands
from worker.images.colour import LINEAR, SRGB, srgb_codes
from worker.images.density import Density
from worker.images.encode import encoded, save
from worker.images.read import ATTRIBUTE_PREFIX
from worker.images.resize import resize
from worker.whole_file import new_file

_HALF_MAX = float(np.finfo(np.float16).max)
_WEBP_QUALITY = 85
_WEBP_METHOD = 2
"""The effort of WebP for a picture that somebody waits for: five times as fast as the default 6, and 2 % larger
(measured on an atlas of the fish)."""
_PNG_LEVEL = 4
"""The compression level of PNG: twice as fast as the default 6 on an integral image, and 2 % larger (measured)."""


def write_exr(path: Path, linear: NDArray[np.floating[Any]], *, attributes: Mapping[str, str]) -> None:
    """Write a master: OpenEXR, linear light, half float, zip-compressed. The same pixels give the same bytes.

    Parameters
    ----------
    path
        The file; writing it is not atomic.
    linear
        `(rows, cols, 3)`, floating. Beyond the range of half floats it is clipped to it.
    attributes
        Texts for the header, as `lippmann:<name>`: the rig's JSON. `read_attributes` gives them back.

    Raises
    ------
    OutputError, DiskFull, DiskUnavailable
        If it cannot be written, and then no part of it is left.
    """
    _check_rgb(linear)
    write_exr_rows(path, (linear,), size=linear.shape[:2], attributes=attributes)


def write_exr_rows(
    path: Path, bands: Iterable[NDArray[np.floating[Any]]], *, size: tuple[int, int], attributes: Mapping[str, str]
) -> None:
    """Write a master from bands of its rows, top down: the same file as `write_exr` of the whole.

    Parameters
    ----------
    path, attributes
        See `write_exr`.
    bands
        `(rows, cols, 3)` each, floating.
    size
        (rows, cols) of the whole.

    Raises
    ------
    OutputError, DiskFull, DiskUnavailable
        See `write_exr`; also if the bands are not the rows of this size.
    """
    settings = {**_settings(attributes), "oiio:ColorSpace": LINEAR}
    write_rows(path, map(_half, bands), size=size, store_as="half", attributes=settings)


def write_channels(
    path: Path,
    bands: Iterable[NDArray[np.float32]],
    names: Sequence[str],
    *,
    size: tuple[int, int],
    attributes: Mapping[str, str],
) -> None:
    """Write numbers as the channels of an EXR, in single precision, zip-compressed; `read_channels` gives them back.

    Parameters
    ----------
    path
        The file; writing it is not atomic.
    bands
        `(rows, cols, channel)` each, top down; NaN stays NaN.
    names
        The names of the channels.
    size
        (rows, cols) of the whole.
    attributes
        See `write_exr`.

    Raises
    ------
    OutputError, DiskFull, DiskUnavailable
        If it cannot be written, and then no part of it is left.
    """
    settings = _settings(attributes)
    write_rows(path, bands, size=size, store_as="float", attributes=settings, channels=names)


def write_png(path: Path, linear: NDArray[np.floating[Any]], *, bits: int = 8, density: Density | None = None) -> None:
    """Write linear light `(rows, cols, 3)` as an sRGB PNG of 8 or 16 bits.

    Raises
    ------
    OutputError, DiskFull, DiskUnavailable
        If it cannot be written, and then no part of it is left.
    """
    with encoded_png(linear, bits=bits, density=density) as file:
        save(file, path)


def encoded_png(
    linear: NDArray[np.floating[Any]], *, bits: int, density: Density | None = None
) -> AbstractContextManager[BinaryIO]:
    """Yield linear light `(rows, cols, 3)` as an sRGB PNG in memory; see `encoded`."""
    _check_rgb(linear)
    if bits not in (8, 16):
        raise OutputError(f"expected a PNG of 8 or 16 bits, got {bits}")
    settings = _png_settings(density)
    return encoded(srgb_codes(linear, bits=bits), to="png", store_as=f"uint{bits}", attributes=settings)


def encoded_exr(linear: NDArray[np.floating[Any]]) -> AbstractContextManager[BinaryIO]:
    """Yield linear light `(rows, cols, 3)` as an OpenEXR of single precision in memory; see `encoded`."""
    _check_rgb(linear)
    settings = {**_settings({}), "oiio:ColorSpace": LINEAR}
    return encoded(linear.astype(np.float32, copy=False), to="openexr", store_as="float", attributes=settings)


def write_code_rows(
    path: Path, bands: Iterable[NDArray[Any]], *, size: tuple[int, int], bits: int = 8, density: Density | None = None
) -> None:
    """Write sRGB codes from bands of their rows, top down, as a PNG or a TIFF by the suffix.

    Parameters
    ----------
    path
        A .png, .tif or .tiff.
    bands
        `(rows, cols, 3)` each, of 8 or 16 bits.
    size
        (rows, cols) of the whole.

    Raises
    ------
    OutputError, DiskFull, DiskUnavailable
        If it cannot be written, and then no part of it is left.
    """
    write = write_png_bands if path.suffix.lower() == ".png" else write_tiff_bands
    with new_file(path) as file:
        write(file, bands, rows=size[0], cols=size[1], bits=bits, density=density)


def write_tiff(path: Path, linear: NDArray[np.floating[Any]], *, bits: int = 8, density: Density | None = None) -> None:
    """Write linear light `(rows, cols, 3)` as an sRGB TIFF of 8 or 16 bits, deflated, with a profile; see `tiff`.

    Raises
    ------
    OutputError, DiskFull, DiskUnavailable
        If it cannot be written, and then no part of it is left.
    """
    _check_rgb(linear)
    codes = srgb_codes(linear, bits=bits)
    with new_file(path) as file:
        write_tiff_bands(file, [codes], rows=codes.shape[0], cols=codes.shape[1], bits=bits, density=density)


def write_thumbnail(path: Path, linear: NDArray[np.floating[Any]], *, longest_px: int = 256) -> None:
    """Write linear light `(rows, cols, 3)` as a small lossy WebP, its longer side `longest_px`, never enlarged.

    Raises
    ------
    OutputError, DiskFull, DiskUnavailable
        If it cannot be written, and then no part of it is left.
    """
    _check_rgb(linear)
    rows, cols = linear.shape[:2]
    shrink = min(1.0, longest_px / max(rows, cols))
    if shrink < 1.0:
        size = {"rows": max(1, round(rows * shrink)), "cols": max(1, round(cols * shrink))}
        linear = resize(linear, **size, filter_name="triangle")
    with encoded_webp(linear) as file:
        save(file, path)


def encoded_webp(linear: NDArray[np.floating[Any]]) -> AbstractContextManager[BinaryIO]:
    """Yield linear light `(rows, cols, 3)` as a lossy sRGB WebP in memory; see `encoded`."""
    _check_rgb(linear)
    settings: dict[str, str | int | float] = {
        "compression": f"webp:{_WEBP_QUALITY}",
        "webp:method": _WEBP_METHOD,
    }
    return encoded(srgb_codes(linear), to="webp", store_as="uint8", attributes=settings)


def _png_settings(density: Density | None) -> dict[str, str | int | float]:
    said = density.png_attributes() if density else {}
    return {"oiio:ColorSpace": SRGB, "png:compressionLevel": _PNG_LEVEL, **said}


def _settings(attributes: Mapping[str, str]) -> dict[str, str]:
    """Return the header of an EXR; the empty date keeps OpenImageIO from putting in today's."""
    return {
        "compression": "zip",
        "DateTime": "",
        **{ATTRIBUTE_PREFIX + name: text for name, text in attributes.items()},
    }


def _half(linear: NDArray[np.floating[Any]]) -> NDArray[np.float16]:
    in_range = linear if linear.dtype == np.float16 else np.clip(linear, -_HALF_MAX, _HALF_MAX)
    half: NDArray[np.float16] = in_range.astype(np.float16, copy=False)
    return half


def _check_rgb(linear: NDArray[np.floating[Any]]) -> None:
    if linear.ndim != 3 or linear.shape[2] != 3 or linear.size == 0 or not np.issubdtype(linear.dtype, np.floating):
        raise OutputError(f"expected linear light (rows, cols, 3), got {linear.dtype} {linear.shape}")
