"""Colour spaces of pictures from other programs: what the codes of a PNG or a TIFF mean in linear light.

A PNG names its colour space in its chunks; where several are present, the order of precedence is cICP, iCCP, sRGB, gAMA
(PNG, third edition, section 4.3). A TIFF has an ICC profile. A file that names none is read as sRGB, with a note.
Floating numbers are linear light. Primaries are not converted.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worker.images.colour import decoded_srgb
from worker.images.foreign.header import read_header
from worker.images.headers.picture import PictureHeader
from worker.images.icc import profile_curve

Decode = Callable[[NDArray[np.float64]], NDArray[np.float64]]

_TRANSFERS: dict[int, tuple[str, float | None]] = {
    4: ("gamma 2.2", 2.2),
    5: ("gamma 2.8", 2.8),
    8: ("linear", 1.0),
    13: ("sRGB", None),
}
"""Transfer characteristics of a cICP chunk (ITU-T H.273, table 3) as exponents; None is sRGB."""


@dataclass(frozen=True)
class ColourSpace:
    """The colour space of a picture: how its codes become linear light."""

    name: str
    """The name of the decoding: `sRGB`, `linear`, `gamma 2.2`, `ICC curve`."""
    decode: Decode
    """Converts codes between 0 and 1 to linear light."""
    known_by: str | None
    """The part of the file that names the colour space; None if no part does and sRGB is assumed."""
    note: str | None = None
    """A note for the user, as a sentence without the file's name."""


NOT_NAMED = "no colour space is named, so the codes are read as sRGB"
"""The note about a picture that names no colour space."""


def linear_space(known_by: str | None) -> ColourSpace:
    """Return the colour space of codes that are proportional to light."""
    return ColourSpace("linear", _same, known_by)


def light_of_codes(codes: NDArray[Any], space: ColourSpace, *, white: float = 1.0) -> NDArray[np.float32]:
    """Return the linear light of codes of a colour space, by a table of all codes.

    Parameters
    ----------
    codes
        Any shape, uint8 or uint16.
    space
        Their colour space.
    white
        The code of white by the highest code; higher ones are white too.
    """
    table = _table(space.decode, 8 * codes.dtype.itemsize, white)
    light: NDArray[np.float32] = table[codes]
    return light


@lru_cache(maxsize=4)
def _table(decode: Decode, bits: int, white: float) -> NDArray[np.float32]:
    return decode(np.minimum(np.arange(2**bits) / ((2**bits - 1) * white), 1)).astype(np.float32)


def file_colour_space(path: Path) -> ColourSpace:
    """Return the colour space of a picture of another program.

    Raises
    ------
    ArtifactMissing
        If there is no such file.
    ArtifactBroken
        If its header cannot be read.
    """
    return colour_space(read_header(path))


def colour_space(header: PictureHeader) -> ColourSpace:
    """Return the colour space of a picture of another program by its header."""
    if header.is_light:
        return linear_space("floating numbers")
    chunks = header.chunks
    if b"cICP" in chunks:
        return _of_cicp(chunks[b"cICP"])
    if header.icc is not None:
        return _of_profile(header.icc)
    if b"sRGB" in chunks:
        return _srgb("sRGB chunk")
    if len(chunks.get(b"gAMA", b"")) == 4 and any(chunks[b"gAMA"]):
        (scaled,) = struct.unpack(">I", chunks[b"gAMA"])
        return _gamma(100_000 / scaled, "gAMA chunk")
    return _srgb(None, NOT_NAMED)


def _of_cicp(content: bytes) -> ColourSpace:
    """Return the colour space of a cICP chunk (primaries, transfer, matrix, full range; PNG 3, section 11.3.2.6)."""
    known_by = "cICP chunk"
    if len(content) != 4 or content[1] not in _TRANSFERS or content[2:] != b"\x00\x01":
        said = ", ".join(map(str, content))
        return _srgb(None, f"the cICP chunk ({said}) is none that can be decoded, so the codes are read as sRGB")
    name, exponent = _TRANSFERS[content[1]]
    space = _srgb(known_by) if exponent is None else _gamma(exponent, known_by)
    if content[0] == 1:
        return space
    return ColourSpace(name, space.decode, known_by, _primaries(f"cICP chunk, primaries {content[0]}"))


def _of_profile(profile: bytes) -> ColourSpace:
    known_by = "ICC profile"
    curve = profile_curve(profile)
    if curve is None:
        return _srgb(None, "the ICC profile has no single tone curve, so the codes are read as sRGB")
    note = None if curve.srgb_primaries else _primaries(known_by)
    if curve.is_srgb:
        return _srgb(known_by, note)
    if curve.exponent == 1.0:
        return ColourSpace("linear", _same, known_by, note)
    name = "ICC curve" if curve.exponent is None else f"gamma {curve.exponent:.4g}"
    return ColourSpace(name, curve.decode, known_by, note)


def _primaries(known_by: str) -> str:
    return f"its primaries ({known_by}) are not those of sRGB and are not converted"


def _srgb(known_by: str | None, note: str | None = None) -> ColourSpace:
    return ColourSpace("sRGB", decoded_srgb, known_by, note)


def _gamma(exponent: float, known_by: str) -> ColourSpace:
    if abs(exponent - 1) < 1e-4:
        return linear_space(known_by)
    return ColourSpace(f"gamma {exponent:.4g}", lambda encoded: encoded**exponent, known_by)


def _same(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    return encoded
