"""The whole lens in a CODE V sequence file: aperture, field, wavelengths, private glasses."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np

from lippmann.job.glasses import Glass
from lippmann.optics.lens.dispersion import LINE_C_NM, LINE_D_NM, LINE_F_NM
from lippmann.optics.lens_files.codev_commands import Command
from lippmann.optics.lens_files.semi_apertures import Aperture, FieldKind, FieldPoint, System
from lippmann.optics.lens_files.zemax_system import ROOM_CELSIUS, VISIBLE_UM

_APERTURES = {"EPD", "FNO", "NA", "NAO"}
_FIELD_KINDS: Mapping[str, FieldKind] = MappingProxyType(
    {"AN": "angle", "OB": "object height", "IM": "image height", "RI": "image height"}
)
_FIELDS = {f"{axis}{name}" for axis in "XY" for name in _FIELD_KINDS}
_VIGNETTING = {"VUX", "VLX", "VUY", "VLY"}
MAX_PRIVATE = 200


class SystemReader:
    """Takes the commands that concern no surface."""

    def __init__(self) -> None:
        self._found: dict[str, list[float]] = {}
        self._private: dict[str, Command] | None = None
        self._glasses: dict[str, Command] = {}
        self._waves: Command | None = None

    def take(self, command: Command) -> bool:
        """Take a command, and return whether it is one of the whole lens."""
        if self._private is not None:
            self._take_private(command)
            return True
        if command.name == "PRV":
            self._private = self._glasses
            return True
        if command.name in _APERTURES | _FIELDS | _VIGNETTING | {"WL", "TEM"}:
            self._found[command.name] = command.numbers()
            return True
        if command.name == "REF" and command.values:
            self._found["REF"] = command.numbers()
            return True
        return False

    def _take_private(self, command: Command) -> None:
        if command.name == "END":
            self._private = None
        elif command.name == "PWL":
            self._waves = command
        elif len(self._glasses) < MAX_PRIVATE:
            self._glasses[command.name.strip("'\"")] = command

    def private_glass(self, name: str) -> Glass | None:
        """Return a glass of the file's own, interpolated over the inverse square of the wavelength."""
        command = self._glasses.get(name.strip("'\"").upper())
        if command is None or self._waves is None:
            return None
        waves, indices = np.array(self._waves.numbers()), np.array(command.numbers())
        if len(waves) != len(indices) or len(waves) < 1 or (waves <= 1).any():
            command.refuse(f"{len(waves)} indices, one for each wavelength of PWL in nm", f"{len(indices)}")
        order = np.argsort(waves)[::-1]
        over = waves[order] ** -2.0
        blue, yellow, red = (
            float(np.interp(line_nm**-2.0, over, indices[order])) for line_nm in (LINE_F_NM, LINE_D_NM, LINE_C_NM)
        )
        reaches = waves.min() <= LINE_F_NM + 1 and waves.max() >= LINE_C_NM - 1
        abbe = (yellow - 1) / (blue - red) if blue > red and reaches else 0.0
        return Glass(index=round(yellow, 6), abbe=round(abbe, 4) if 1.0 <= abbe <= 1000.0 else None)

    def system(self, *, object_mm: float, mm: float) -> System:
        """Return the aperture and the field.

        Parameters
        ----------
        object_mm
            The distance of the object before surface 1, mm.
        mm
            The length of the file's unit, mm.
        """
        return System(aperture=self._aperture(mm), fields=tuple(self._fields(mm)), object_mm=abs(object_mm))

    def _aperture(self, mm: float) -> Aperture | None:
        values = {name: self._found[name][0] for name in _APERTURES if self._found.get(name)}
        if values.get("EPD", 0) > 0:
            return Aperture("entrance pupil", values["EPD"] * mm)
        if values.get("FNO", 0) > 0:
            return Aperture("f-number", values["FNO"])
        if values.get("NA", 0) > 0:
            return Aperture("image aperture", values["NA"])
        return Aperture("object aperture", values["NAO"]) if values.get("NAO", 0) > 0 else None

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
        if temperature and temperature[0] != ROOM_CELSIUS:
            yield f"the file's temperature of {temperature[0]:g} degrees Celsius is ignored"
        waves, chosen = self._found.get("WL", []), int((self._found.get("REF") or [1.0])[0])
        wave_um = waves[chosen - 1] / 1000 if 0 < chosen <= len(waves) else 0.0
        least, most = VISIBLE_UM
        if wave_um > 0 and not least <= wave_um <= most:
            yield (
                f"the file is designed for {wave_um:g} micrometres; glasses have their index at 587.6 nm, so focal "
                "lengths differ from those of the file"
            )
