"""sRGB as an ICC profile, for files that say by a profile what their codes mean: TIFF and PDF.

Made here rather than copied, so that it is small, free, and the same bytes every time: a display profile of version 2
(ICC.1:2001-04), which every program for print reads. Its curve is IEC 61966-2-1 at 1024 points, its primaries are those
of sRGB adapted to D50 by the Bradford transform, as the ICC's own sRGB profile has them.
"""

from __future__ import annotations

import struct
from functools import lru_cache

import numpy as np

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
