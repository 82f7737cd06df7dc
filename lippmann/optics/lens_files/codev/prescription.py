"""Lens designs of CODE V: the plain subset of a sequence file (.seq).

The reader uses DIM, RDM, TIT, SO, S, SI, RDY, CUY, THI, GLA, STO, CIR, ASP, CON, SPH, K, A to H, the private glasses of
PRV, and for absent semi-diameters EPD, FNO, NA, NAO, the fields and the vignetting. What does not affect rays is
ignored; every other command is refused by its name, with its line.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from lippmann.errors import SpecError
from lippmann.job.optics.glasses import Glass
from lippmann.job.optics.rig import MM_PER_INCH
from lippmann.optics.lens_files.codev.commands import Command, read_commands
from lippmann.optics.lens_files.codev.glasses import PrivateGlasses
from lippmann.optics.lens_files.codev.surfaces import TERMS, CodevSurface
from lippmann.optics.lens_files.codev.system import SystemReader
from lippmann.optics.lens_files.glasses.search import AIR, GlassSearch
from lippmann.optics.lens_files.lens_file import LensFile
from lippmann.optics.lens_files.rows import Row, prescription_of_rows
from lippmann.optics.lens_files.semi_apertures import MAX_ROWS, with_semi_apertures

MM_PER_DIM = {"M": 1.0, "C": 10.0, "I": MM_PER_INCH}
IGNORED = frozenset(
    [
        *("LEN", "INI", "GO", "SLB", "WTW", "WTF", "DER", "PIM", "CLS", "REF", "SPH", "CON", "ASP", "CA", "POL"),
        *("CCY", "THC", "GLC", "KC", "AC", "BC", "CC", "DC", "EC", "FC", "GC", "HC", "JC"),
    ]
)
"""Commands that move no ray: names, weights, what is varied, and kinds of surfaces, whose numbers count."""
ZERO_IS_NONE = frozenset({"CUF", "J", "ADE", "BDE", "CDE", "XDE", "YDE", "ZDE", "ADX", "ADY"})
"""Commands that cannot be modelled, but for 0."""
ROUND = "a circular aperture (CIR)"
EXPECTED: Mapping[str, str] = MappingProxyType(
    {
        "ZOO": "a lens of one zoom position: save each position as a lens of its own",
        **dict.fromkeys(("REX", "REY", "ELX", "ELY"), ROUND),
    }
)
"""The words for what is expected in the place of commands that cannot be modelled."""
APERTURES = frozenset({"EDG", "CLR", "OBS", "HOL"})
"""The words that may stand between CIR and the semi-diameter."""
NOT_LENSES = frozenset({"REFL", "TIR"})
SUPPORTED = "RDM DIM TIT SO S SI RDY CUY THI GLA STO CIR K A-H PRV EPD FNO NA NAO WL and fields"

_SURFACE = re.compile(r"S(?:O|I|K|\d{1,4})?")
_CODED_INDEX = re.compile(r"([\d.]+):([\d.]+)")


def read_lens_seq(text: str, glasses: GlassSearch | None = None) -> LensFile:
    """Return the lens in the text of a CODE V sequence file.

    Parameters
    ----------
    text
        The content of the file.
    glasses
        Where glasses are looked up; by default in the built-in table.

    Raises
    ------
    InvalidText
        If the text has too many lines.
    SpecError
        The error names the line, the command, the expected value and the value received.
    """
    reader = _Reader(GlassSearch() if glasses is None else glasses)
    for command in read_commands(text):
        reader.take(command)
    return reader.lens()


class _Reader:
    """Takes the commands one by one, as the program does."""

    def __init__(self, glasses: GlassSearch) -> None:
        self.glasses = glasses
        self.private = PrivateGlasses()
        self.system = SystemReader()
        self.surfaces: list[CodevSurface] = []
        self.has_image = False
        self.title = ""
        self.mm = 1.0
        self.radius_mode: bool | None = None
        self.current = 0

    def take(self, command: Command) -> None:
        name = command.word
        if self.private.take(command) or self.system.take(command) or name in IGNORED:
            return
        if _SURFACE.fullmatch(name):
            self._take_surface(command)
        elif name == "TIT":
            self.title = " ".join(command.values).strip()[:200]
        elif name == "RDM":
            self.radius_mode = not command.values or command.values[0].upper().startswith("Y")
        elif name == "DIM":
            unit = command.values[0].upper()[:1] if command.values else ""
            self.mm = MM_PER_DIM[unit] if unit in MM_PER_DIM else command.refuse("M (mm), C (cm) or I (inches)")
        else:
            self._take_property(command)

    def _take_surface(self, command: Command) -> None:
        """Take SO, S, SI or S with a number: a new surface, or one that is there already."""
        name = command.word[1:]
        if name == "I":
            self.has_image = True
        if not self.surfaces and not name:
            self.surfaces.append(CodevSurface(command, thickness=math.inf))  # An object, if the file gives none.
        if not name and self.has_image:
            command.refuse("all surfaces before the image (SI)")
        place = self._place(command, name) if name and name != "I" else len(self.surfaces)
        if place == len(self.surfaces):
            if place > MAX_ROWS:
                command.refuse(f"at most {MAX_ROWS} surfaces", "more")
            self.surfaces.append(CodevSurface(command))
        self.current = place
        surface = self.surfaces[place]
        if command.values:
            surface.bend, surface.is_radius = command.distance(), None
        if len(command.values) > 1:
            surface.thickness = command.distance(1)
        if len(command.values) > 2:
            self._set_glass(command, surface, command.values[2])

    def _place(self, command: Command, name: str) -> int:
        place = 0 if name == "O" else len(self.surfaces) - 1 if name in "IK" else int(name)
        if not 0 <= place <= len(self.surfaces):
            command.refuse(f"a surface from S0 to S{max(0, len(self.surfaces) - 1)}", f"S{name}")
        return place

    def _take_property(self, command: Command) -> None:
        """Take a command that concerns one surface: the last one, or the one that it names first."""
        if command.word == "PIK":
            self._take_pickup(command)
            return
        if command.word in EXPECTED:
            command.refuse(EXPECTED[command.word])
        surface, rest = self._surface_of(_in_order(command) if command.word == "CIR" else command)
        name = rest.word
        if name in ("RDY", "CUY", "THI") and _is_solve(rest):
            surface.solves.append((rest, name))
        elif name in ("RDY", "CUY"):
            surface.bend, surface.is_radius = rest.distance(), name == "RDY"
        elif name == "THI":
            surface.thickness = rest.distance()
        elif name == "GLA":
            self._set_glass(rest, surface, rest.values[0] if rest.values else "")
        elif name == "STO":
            for one in self.surfaces:
                one.is_stop = one is surface  # A later STO moves the stop.
        elif name == "CIR":
            self._set_aperture(rest, surface)
        elif name == "K":
            surface.conic = rest.value()
        elif len(name) == 1 and name in TERMS:
            surface.terms[TERMS.index(name)] = rest.value()
        elif name not in ZERO_IS_NONE or not rest.values or rest.value() != 0:
            rest.refuse(f"only {SUPPORTED}; this command cannot be modelled")

    def _surface_of(self, command: Command) -> tuple[CodevSurface, Command]:
        values = command.values
        place = self.current
        is_glass = command.word == "GLA" and len(values) < 2  # A private glass may be named S1.
        if values and not is_glass and _names_surface(values[0]):
            place = self._place(command, values[0].upper()[1:])
            values = values[1:]
        rest = Command(command.number, command.word, values)
        if place >= len(self.surfaces):
            rest.refuse(f"only {SUPPORTED}; a property behind its surface")
        return self.surfaces[place], rest

    def _take_pickup(self, command: Command) -> None:
        kind = command.values[0].upper() if command.values else ""
        surface, rest = self._surface_of(Command(command.number, command.word, command.values[1:]))
        surface.solves.append((rest, kind))

    def _set_glass(self, command: Command, surface: CodevSurface, name: str) -> None:
        if name.upper() in NOT_LENSES:
            command.refuse("a surface that refracts: mirrors cannot be modelled", name)
        surface.glass, surface.glass_name = command, name

    def _set_aperture(self, command: Command, surface: CodevSurface) -> None:
        kind = command.values[0].upper() if command.values else ""
        if kind in ("OBS", "HOL"):
            command.refuse("a clear aperture; obscurations and holes cannot be modelled")
        size = abs(command.value(1 if kind in ("EDG", "CLR") else 0))
        if kind == "EDG":
            surface.edge = size
        else:
            surface.semi_aperture = size

    def lens(self) -> LensFile:
        self.private.check_end()
        lenses = self.surfaces[1 : -1 if self.has_image else None]
        if len(self.surfaces) < 3 or not lenses:
            expected = "a .seq file with an object (SO), surfaces (S) and an image (SI)"
            raise SpecError(f"expected {expected}, got {len(self.surfaces)} surfaces")
        as_radius = self._as_radius(lenses)
        rows = [self._row(place, surface, as_radius) for place, surface in enumerate(lenses, start=1)]
        for row, surface in zip(rows, lenses, strict=True):
            for note in surface.solve_notes(row.place, is_last=surface is lenses[-1]):
                self.glasses.note(note)
        system = self.system.system(object_mm=self.surfaces[0].thickness * self.mm, mm=self.mm)
        rows, computed = with_semi_apertures(rows, system, words="CIR; EPD, FNO, NA, NAO")
        notes = [*self.glasses.notes, *self.system.notes(), *computed]
        return prescription_of_rows(rows, title=self.title, notes=notes)

    def _as_radius(self, surfaces: list[CodevSurface]) -> bool:
        """Return whether the numbers of S are radii; without RDM, a number of 1 or more is no curvature of a lens."""
        if self.radius_mode is not None:
            return self.radius_mode
        undecided = [surface.bend for surface in surfaces if surface.is_radius is None]
        is_radius = any(abs(bend) >= 1 for bend in undecided)
        if any(undecided):
            what = "radii, because some are 1 or more" if is_radius else "curvatures, as without RDM in CODE V"
            self.glasses.note(f"the file has no RDM: the numbers of its surfaces are read as {what}")
        return is_radius

    def _row(self, place: int, surface: CodevSurface, as_radius: bool) -> Row:
        if surface.is_radius is None:
            surface.is_radius = as_radius
        row = surface.shape_mm(mm=self.mm) | self._medium(surface)
        return Row(f"line {surface.command.number}, S{place}", row, is_stop=surface.is_stop)

    def _medium(self, surface: CodevSurface) -> dict[str, Any]:
        name, command = surface.glass_name, surface.glass
        if command is None or not name or name.upper() in AIR:
            return {"index": 1.0}
        if found := _CODED_INDEX.fullmatch(name):
            try:
                coded = Glass(float(found[1]), float(found[2]) or None)
            except ValueError:
                command.refuse("an index and an Abbe number, as in 1.5168:64.17", name)
            return self.glasses.medium(command.place, "", coded)
        known = self.private.find(name, self.glasses) or self.glasses.find(name)
        if known is None:
            command.refuse(self.glasses.expected(name), name[:100])
        return self.glasses.medium(command.place, name, known)


def _in_order(command: Command) -> Command:
    """Return an aperture with the surface first, then its kind, then its size, and without a label as L'A'."""
    values = [value for value in command.values if not value.upper().startswith(("L'", 'L"'))]
    values.sort(key=lambda value: (not _names_surface(value), value.upper() not in APERTURES))
    return Command(command.number, command.word, tuple(values))


def _names_surface(value: str) -> bool:
    return _SURFACE.fullmatch(value.upper()) is not None and value.upper() != "S"


def _is_solve(command: Command) -> bool:
    """Return whether a word stands in the place of the number, as in THI HMY 0."""
    word = command.values[0].upper() if command.values else ""
    return word.isalpha() and word not in ("INF", "INFINITY", "NAN")
