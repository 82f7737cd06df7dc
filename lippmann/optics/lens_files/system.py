"""The light for which a lens is designed, as the files of all formats describe it: aperture, field, object."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

ApertureKind = Literal[
    "entrance pupil",
    "f-number",
    "working f-number",
    "image aperture",
    "object aperture",
    "object cone",
    "stop",
]
FieldKind = Literal["angle", "object height", "image height"]

FAR_MM = 1e9
"""The distance from which an object counts as infinitely far."""
VISIBLE_UM = (0.38, 0.78)
ROOM_CELSIUS = 20.0


@dataclass(frozen=True)
class Aperture:
    """The aperture of a whole lens, as design programs define it.

    An f-number is that of a distant object, focal length by entrance pupil; the working f-number and the image aperture
    are those of the object of the file.
    """

    kind: ApertureKind
    value: float = 0.0
    """A diameter in mm, a ratio, a numerical aperture, or half the angle of the object cone in degrees; none for the
    stop, whose semi-diameter is that of its row."""

    @property
    def slope(self) -> float:
        """The slope of the marginal ray before or behind the lens; NaN if the aperture gives none."""
        if self.kind == "working f-number" and self.value > 0:
            return 1.0 / (2.0 * self.value)
        if self.kind in ("image aperture", "object aperture") and 0 < self.value < 1:
            return math.tan(math.asin(self.value))
        if self.kind == "object cone" and 0 < self.value < 90:
            return math.tan(math.radians(self.value))
        return math.nan


@dataclass(frozen=True)
class FieldPoint:
    """A point of the field, and the part of the stop that its light may use."""

    kind: FieldKind
    value: float
    """Degrees for an angle, mm for a height."""
    low: float = -1.0
    high: float = 1.0
    """The limits of the bundle in the stop, in semi-diameters."""


@dataclass(frozen=True)
class System:
    """The light for which a lens is designed."""

    aperture: Aperture | None = None
    fields: tuple[FieldPoint, ...] = ()
    object_mm: float = math.inf
    """The distance of the object before the first row; negative for an object behind it."""

    @property
    def is_far(self) -> bool:
        """True if the object is infinitely far."""
        return abs(self.object_mm) >= FAR_MM


def ignored_notes(*, wavelength_um: float, temperature_c: float | None) -> Iterator[str]:
    """Yield a note for a wavelength and for a temperature that are ignored and matter.

    Parameters
    ----------
    wavelength_um
        The wavelength of the design, micrometres; 0 if the file has none.
    temperature_c
        The temperature of the design, degrees Celsius; None if the file has none.
    """
    least, most = VISIBLE_UM
    if wavelength_um > 0 and not least <= wavelength_um <= most:
        yield (
            f"the file is designed for {wavelength_um:g} micrometres; glasses have their index at 587.6 nm, so focal "
            "lengths differ from those of the file"
        )
    if temperature_c is not None and temperature_c != ROOM_CELSIUS:
        yield f"the file's temperature of {temperature_c:g} degrees Celsius is ignored"
