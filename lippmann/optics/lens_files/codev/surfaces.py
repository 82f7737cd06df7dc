"""A surface of a CODE V sequence file: its numbers as the commands give them, and in mm."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from lippmann.optics.lens_files.codev.commands import Command
from lippmann.optics.lens_files.rows import radius_or_plane

TERMS = "ABCDEFGH"
"""The coefficients of r^4 to r^18."""


@dataclass
class CodevSurface:
    """A surface in the unit of the file; the commands change it one by one."""

    command: Command
    """The command that names the surface first."""
    bend: float = 0.0
    """The radius, or the curvature, as `is_radius` says; 0 is a plane."""
    is_radius: bool | None = None
    """None if the radius mode of the file decides."""
    thickness: float = 0.0
    glass: Command | None = None
    glass_name: str = ""
    semi_aperture: float = 0.0
    edge: float = 0.0
    is_stop: bool = False
    conic: float = 0.0
    terms: dict[int, float] = field(default_factory=dict)
    solves: list[tuple[Command, str]] = field(default_factory=list)
    """The solves and pickups, and the command whose number they give."""

    def shape_mm(self, *, mm: float) -> dict[str, Any]:
        """Return the fields of a `LensSurface` but for the medium.

        Parameters
        ----------
        mm
            The length of the file's unit, mm.
        """
        if math.isinf(self.thickness):
            self.command.refuse("a finite thickness")
        if math.isinf(self.bend) and not self.is_radius:
            self.command.refuse("a finite curvature")
        radius = math.inf if self.bend == 0 else self.bend if self.is_radius else 1.0 / self.bend
        shape: dict[str, Any] = {
            "radius_mm": radius_or_plane(radius * mm),
            "thickness_mm": self.thickness * mm,
            "conic": self.conic,
            "aspheric": self._aspheric(mm),
        }
        semi = self.semi_aperture or self.edge
        return shape | ({"semi_aperture_mm": semi * mm} if semi > 0 else {})

    def _aspheric(self, mm: float) -> tuple[float, ...]:
        last = max((place for place, term in self.terms.items() if term), default=-1)
        terms = (self.terms.get(place, 0.0) for place in range(last + 1))
        return tuple(term / mm ** (2 * place + 3) for place, term in enumerate(terms))

    def solve_notes(self, place: str, *, is_last: bool) -> Iterator[str]:
        """Yield a note for every solve and pickup, none of which is computed.

        Parameters
        ----------
        place
            The words that name the surface in the note.
        is_last
            True for the last surface of the lens, behind which the distance does not count.

        Raises
        ------
        SpecError
            If the surface has no number of its own.
        """
        for command, kind in self.solves:
            if kind == "THI" and is_last:
                continue
            if not {"RDY": self.bend, "CUY": self.bend, "THI": self.thickness}.get(kind):
                command.refuse(f"a number for {place}: solves and pickups are not computed")
            yield f"{command.place}: solves and pickups are not computed; the number of {place} is used"
