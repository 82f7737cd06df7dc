"""The whole lens in a CODE V sequence file: aperture, field, wavelengths."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType

from lippmann.optics.lens_files.codev.commands import Command
from lippmann.optics.lens_files.system import Aperture, ApertureKind, FieldKind, FieldPoint, System, ignored_notes

_APERTURES: Mapping[str, ApertureKind] = MappingProxyType(
    {"EPD": "entrance pupil", "FNO": "working f-number", "NA": "image aperture", "NAO": "object aperture"}
)
"""The kinds of aperture by their commands; FNO and NA are those of the object of the file."""
_FIELD_KINDS: Mapping[str, FieldKind] = MappingProxyType(
    {"AN": "angle", "OB": "object height", "IM": "image height", "RI": "image height"}
)
_FIELDS = {f"{axis}{name}" for axis in "XY" for name in _FIELD_KINDS}
_VIGNETTING = {"VUX", "VLX", "VUY", "VLY"}
_NUMBERS = {*_APERTURES, *_FIELDS, *_VIGNETTING, "WL", "TEM"}


class SystemReader:
    """Takes the commands that concern no surface."""

    def __init__(self) -> None:
        self._found: dict[str, list[float]] = {}

    def take(self, command: Command) -> bool:
        """Take a command, and return whether it is one of the whole lens."""
        if command.word in _NUMBERS or (command.word == "REF" and command.values):
            self._found.pop(command.word, None)  # The dictionary keeps the order in which they are given last.
            self._found[command.word] = command.all_numbers()
            return True
        return False

    def system(self, *, object_mm: float, mm: float) -> System:
        """Return the aperture and the field.

        Parameters
        ----------
        object_mm
            The distance of the object before surface 1, mm.
        mm
            The length of the file's unit, mm.
        """
        return System(aperture=self._aperture(mm), fields=tuple(self._fields(mm)), object_mm=object_mm)

    def _aperture(self, mm: float) -> Aperture | None:
        """Return the aperture that is given last, as each replaces the one before."""
        for name in reversed(self._found):
            kind, value = _APERTURES.get(name), (self._found[name] or [0.0])[0]
            if kind is not None and value > 0:
                return Aperture(kind, value * mm if kind == "entrance pupil" else value)
        return None

    def _fields(self, mm: float) -> Iterator[FieldPoint]:
        for names, kind in _FIELD_KINDS.items():
            x, y = self._found.get(f"X{names}", []), self._found.get(f"Y{names}", [])
            for place in range(max(len(x), len(y))):
                across, along = (axis[place] if place < len(axis) else 0.0 for axis in (x, y))
                upper, lower = (self._vignetting(name, place) for name in ("VUY", "VLY"))
                if across:
                    upper = lower = 0.0  # The factors are of the y axis.
                value = math.hypot(across, along) * (1.0 if kind == "angle" else mm)
                yield FieldPoint(kind, value, lower - 1.0, 1.0 - upper)

    def _vignetting(self, name: str, place: int) -> float:
        values = self._found.get(name, [])
        return min(max(values[place], 0.0), 0.99) if place < len(values) else 0.0

    def notes(self) -> Iterator[str]:
        """Yield what is ignored and matters: a wavelength that is not visible, a temperature."""
        temperature = self._found.get("TEM", [])[:1]
        waves, chosen = self._found.get("WL", []), int((self._found.get("REF") or [1.0])[0])
        wave_um = waves[chosen - 1] / 1000 if 0 < chosen <= len(waves) else 0.0
        yield from ignored_notes(wavelength_um=wave_um, temperature_c=temperature[0] if temperature else None)
