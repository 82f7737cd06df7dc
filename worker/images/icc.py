"""ICC profiles: the sRGB profile of the TIFF and PDF files that we write, the tone curve of profiles in files we read.

The sRGB profile is made here rather than copied, so that it is small, free, and the same bytes every time: a display
profile of version 2 (ICC.1:2001-04), which every program for print reads.
Its curve is IEC 61966-2-1 at 1024 points, its primaries are those of sRGB adapted to D50 by the Bradford transform, as
the ICC's own sRGB profile has them.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from worker.images.colour import decoded_srgb

_D50 = (0.9642, 1.0, 0.8249)
_PRIMARIES = {
    b"rXYZ": (0.43607, 0.22249, 0.01392),
    b"gXYZ": (0.38515, 0.71687, 0.09708),
    b"bXYZ": (0.14307, 0.06061, 0.71410),
}
_CURVE_POINTS = 1024
_MADE = (2026, 1, 1, 0, 0, 0)
"""The date that the header must carry."""
_TAGS_AT_MOST = 200
_NEAR = 0.002
"""The largest difference in linear light between a curve and sRGB, or a power law, that it is taken for."""
_PRIMARIES_NEAR = 0.01
_PARAMETERS = {0: 1, 1: 3, 2: 4, 3: 5, 4: 7}
"""The number of parameters of a parametric curve, by its function type."""


@dataclass(frozen=True)
class ToneCurve:
    """The tone curve that the three channels of a profile share."""

    decode: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    """Converts codes between 0 and 1 to linear light."""
    exponent: float | None
    """The exponent, where the curve is a power law; 1 is linear."""
    is_srgb: bool
    """True if the curve is that of sRGB, within 0.002 of white."""
    srgb_primaries: bool
    """True if the primaries are those of sRGB, within 0.01; grey has none and counts as sRGB."""


def profile_curve(profile: bytes) -> ToneCurve | None:
    """Return the tone curve of an RGB or grey matrix profile (ICC.1:2022, sections 7, 10.6 and 10.18).

    None is returned for a profile without tone curves, with different ones for its channels, or damaged.
    """
    try:
        tags = _tags(profile)
        curves = {tags[name] for name in (b"rTRC", b"gTRC", b"bTRC")} if b"rTRC" in tags else {tags[b"kTRC"]}
        if len(curves) > 1:
            return None
        decode, exponent = _decoder(curves.pop())
        primaries = all(
            np.allclose(np.divide(struct.unpack_from(">3i", tags[name], 8), 65536), place, atol=_PRIMARIES_NEAR)
            for name, place in _PRIMARIES.items()
            if name in tags
        )
    except (KeyError, ValueError, struct.error):
        return None
    codes = np.linspace(0.0, 1.0, 257)
    with np.errstate(all="ignore"):
        light = decode(codes)
    if not np.isfinite(light).all():
        return None
    if exponent is None and np.abs(light - codes).max() < _NEAR:
        exponent = 1.0
    return ToneCurve(decode, exponent, bool(np.abs(light - decoded_srgb(codes)).max() < _NEAR), primaries)


def _tags(profile: bytes) -> dict[bytes, bytes]:
    if profile[36:40] != b"acsp" or profile[16:20] not in (b"RGB ", b"GRAY"):
        raise ValueError("not an RGB or grey profile")
    (count,) = struct.unpack_from(">I", profile, 128)
    if count > _TAGS_AT_MOST:
        raise ValueError("too many tags")
    entries = [struct.unpack_from(">4sII", profile, 132 + 12 * place) for place in range(count)]
    return {name: profile[start : start + size] for name, start, size in entries}


def _decoder(tag: bytes) -> tuple[Callable[[NDArray[np.float64]], NDArray[np.float64]], float | None]:
    """Return a curve as a function, and its exponent if it is a power law."""
    if tag[:4] == b"curv":
        (count,) = struct.unpack_from(">I", tag, 8)
        if count > 1:
            if len(tag) < 12 + 2 * count:
                raise ValueError("the curve is cut short")
            table = np.frombuffer(tag, ">u2", count, 12) / 65535
            places = np.linspace(0.0, 1.0, count)
            return lambda codes: np.interp(codes, places, table), None
        exponent = struct.unpack_from(">H", tag, 12)[0] / 256 if count else 1.0
        return lambda codes: codes**exponent, exponent
    if tag[:4] != b"para":
        raise ValueError("not a curve")
    (kind,) = struct.unpack_from(">H", tag, 8)
    numbers = [number / 65536 for number in struct.unpack_from(f">{_PARAMETERS[kind]}i", tag, 12)]
    return _parametric(numbers), numbers[0] if kind == 0 else None


def _parametric(numbers: list[float]) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Return a parametric curve (ICC.1:2022, table 68): a power law above a threshold, a line below it."""
    exponent, *rest = numbers
    match rest:
        case []:
            a, b, c, d, e, f = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
        case [a, b]:
            c, d, e, f = 0.0, -b / a if a else 0.0, 0.0, 0.0
        case [a, b, e]:
            c, d, f = 0.0, -b / a if a else 0.0, e
        case [a, b, c, d]:
            e, f = 0.0, 0.0
        case _:
            a, b, c, d, e, f = rest
    return lambda codes: np.where(codes >= d, np.maximum(a * codes + b, 0) ** exponent + e, c * codes + f)


@lru_cache(maxsize=1)
def srgb_profile() -> bytes:
    """Return the profile."""
    curve = _curve()
    tags = {
        b"desc": _described("sRGB IEC61966-2.1"),
        b"cprt": b"text\0\0\0\0" + b"No copyright, use freely\0",
        b"wtpt": _xyz(_D50),
        **{name: _xyz(place) for name, place in _PRIMARIES.items()},
        b"rTRC": curve,
        b"gTRC": curve,
        b"bTRC": curve,
    }
    table, data = b"", b""
    first = 128 + 4 + 12 * len(tags)
    places: dict[bytes, int] = {}
    for name, content in tags.items():
        if content not in places:
            places[content] = first + len(data)
            data += content + b"\0" * (-len(content) % 4)
        table += struct.pack(">4sII", name, places[content], len(content))
    return _header(first + len(data)) + struct.pack(">I", len(tags)) + table + data


def _header(size: int) -> bytes:
    head = struct.pack(">I4xI4s4s4s6H4s", size, 0x02100000, b"mntr", b"RGB ", b"XYZ ", *_MADE, b"acsp")
    head += b"\0" * (68 - len(head)) + _fixed(_D50)
    return head.ljust(128, b"\0")


def _curve() -> bytes:
    code = np.linspace(0.0, 1.0, _CURVE_POINTS)
    codes: bytes = np.rint(decoded_srgb(code) * 65535).astype(">u2").tobytes()
    return struct.pack(">4s4xI", b"curv", _CURVE_POINTS) + codes


def _xyz(place: tuple[float, float, float]) -> bytes:
    return b"XYZ \0\0\0\0" + _fixed(place)


def _fixed(place: tuple[float, float, float]) -> bytes:
    """Return numbers as s15Fixed16."""
    return struct.pack(">3i", *(round(number * 65536) for number in place))


def _described(text: str) -> bytes:
    """Return a textDescriptionType with the text in ASCII alone."""
    ascii_text = text.encode("ascii") + b"\0"
    return b"desc\0\0\0\0" + struct.pack(">I", len(ascii_text)) + ascii_text + b"\0" * (4 + 4 + 2 + 1 + 67)
