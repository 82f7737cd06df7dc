"""The whole lens in the head of a .zmx file: its aperture, its field, its wavelength and its catalogues."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType

from lippmann.optics.lens_files.system import Aperture, ApertureKind, FieldKind, FieldPoint, System, ignored_notes
from lippmann.optics.lens_files.zemax.lines import Block

_APERTURES: Mapping[str, tuple[ApertureKind, ApertureKind]] = MappingProxyType(
    {
        "ENPD": ("entrance pupil", "entrance pupil"),
        "FNUM": ("f-number", "working f-number"),
        "OBNA": ("object aperture", "object cone"),
    }
)
"""The kinds of aperture by their words, with the flag behind the value 0 and 1."""
_FIELD_KINDS: tuple[FieldKind, ...] = ("angle", "object height", "image height", "image height")
"""The kinds of field by the number behind FTYP; the last one is a real image height."""


def system_of(head: Block, *, object_mm: float, mm: float) -> System:
    """Return the aperture and the field of the head of a file.

    Parameters
    ----------
    head
        The lines before the first SURF.
    object_mm
        The distance of the object before surface 1, mm.
    mm
        The length of the file's unit, mm.
    """
    return System(aperture=_aperture(head, mm), fields=tuple(_fields(head, mm)), object_mm=object_mm)


def _aperture(head: Block, mm: float) -> Aperture | None:
    for word, kinds in _APERTURES.items():
        value, flag = (*head.numbers(word), 0.0, 0.0)[:2]
        if value > 0:
            kind = kinds[1 if flag == 1 else 0]
            return Aperture(kind, value * mm if kind == "entrance pupil" else value)
    return Aperture("stop") if head.first("FLOA") else None


def _fields(head: Block, mm: float) -> Iterator[FieldPoint]:
    number = int((head.numbers("FTYP") or [0.0])[0])
    kind: FieldKind = _FIELD_KINDS[number] if 0 <= number < len(_FIELD_KINDS) else "angle"
    count = int((head.numbers("FTYP")[2:3] or [12.0])[0])
    x, y = (_values(head, axis, count) for axis in "XY")
    decentres, narrowings = head.numbers("VDYN"), head.numbers("VCYN")
    for place in range(min(count, max(len(x), len(y)))):
        values = [axis[place] if place < len(axis) else 0.0 for axis in (x, y, decentres, narrowings)]
        size, middle, half = math.hypot(values[0], values[1]), values[2], 1.0 - values[3]
        value = size if kind == "angle" else size * mm
        if values[0] or not 0 < half <= 1:
            middle, half = 0.0, 1.0  # Vignetting factors are of the y axis.
        yield FieldPoint(kind, value, middle - half, middle + half)


def _values(head: Block, axis: str, count: int) -> list[float]:
    """Return the coordinates of the fields along an axis: all in one line, or one a line in older files."""
    one_line = head.numbers(f"{axis}FLN")
    lines = [line.leading_numbers() for line in head.lines if line.word == f"{axis}FLD"]
    return one_line or [numbers[1] for numbers in lines if len(numbers) > 1][: max(count, 0)]


def notes_of(head: Block) -> Iterator[str]:
    """Yield what is ignored in the head of a file and matters: its wavelength, temperature, other configurations.

    Parameters
    ----------
    head
        The lines before the first SURF.
    """
    temperature = head.numbers("ENVD")[:1]
    count, chosen = (*head.numbers("MNUM"), 1.0, 1.0)[:2]
    if count > 1:
        yield f"the file has {count:g} configurations; only number {chosen:g} is read, whose values its surfaces have"
    yield from ignored_notes(wavelength_um=_primary_um(head), temperature_c=temperature[0] if temperature else None)


def _primary_um(head: Block) -> float:
    chosen = int((head.numbers("PWAV") or [1.0])[0])
    for line in head.lines:
        numbers = line.leading_numbers() if line.word == "WAVM" else []
        if len(numbers) > 1 and int(numbers[0]) == chosen:
            return numbers[1]
    series = head.numbers("WAVL") or head.numbers("WAVN")
    return series[chosen - 1] if 0 < chosen <= len(series) else 0.0
