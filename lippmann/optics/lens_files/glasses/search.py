"""The glass of a name in a lens file: from catalogues, from the built-in table, or a six-digit code."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.optics.glasses import (
    MAX_NAME,
    SCHOTT,
    Glass,
    NamedGlass,
    expected_glass,
    find_glass,
    glass_key,
    glasses_by_maker,
)
from lippmann.optics.lens_files.glasses.agf import Catalogue, CatalogueGlass
from lippmann.optics.lens_files.lines import wrong

GAS = 1e-3
"""The greatest difference of the index from 1 for which a medium is a gas and counts as air."""
AIR = frozenset({"AIR", "VACUUM"})
"""The names of media of index 1."""
FOR_VISIBLE_LIGHT = "a glass for visible light: its index is needed at 587.6 nm"
CATALOGUE_HINT = "or a catalogue that has it (--catalogue FILE.agf)"

_LETTERS = re.compile(r"[A-Z]+")
_CODE = re.compile(r"(\d{3})(\d{3})")
"""A glass as MIL-G-174 writes it: three digits of nd - 1, three of Vd."""
_DOTTED_CODE = re.compile(r"(\d{3,8})\.(\d{3,8})")
"""A glass as CODE V writes it: the digits of nd - 1, a point, the digits of Vd / 100."""


@dataclass
class GlassSearch:
    """A search for glasses by name, which collects what a user should know of them."""

    catalogues: Sequence[Catalogue] = ()
    """The catalogues of the user, which count first, in their order."""
    makers: Sequence[str] = ()
    """The makers whose glasses count first in the built-in table."""
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        for catalogue in self.catalogues:
            if catalogue.note:
                self.note(catalogue.note)

    def find(self, name: str) -> Glass | None:
        """Return the glass of a name; None for an unknown name.

        Raises
        ------
        SpecError
            If a catalogue has the glass, and gives it no index for visible light.
        """
        if len(name) > MAX_NAME:
            return None
        for catalogue in self.catalogues:
            found = _in_catalogue(catalogue, name)
            if found is not None:
                return self._computed(catalogue, name, found)
        entry = find_glass(name, self.makers)
        if entry is None:
            return coded_glass(name)
        self._note_maker(name, entry)
        return entry.glass

    def expected(self, name: str) -> str:
        """Return what a message expects instead of an unknown name."""
        return f"{expected_glass(name)}, {CATALOGUE_HINT}"

    def medium(self, place: str, name: str, found: Glass) -> dict[str, Any]:
        """Return the fields of a surface for the medium behind it; a gas is air, and a note says so.

        Parameters
        ----------
        place
            The words that name the surface in the note.
        name
            The name of the medium; empty if it has none.
        found
            The medium.
        """
        if found.index != 1.0 and abs(found.index - 1.0) < GAS:
            self.note(f"{place}: the medium of index {found.index:g} is taken for air")
        if abs(found.index - 1.0) < GAS:
            return {"index": 1.0}
        named = {"material": name} if name else {}
        return {**named, "index": found.index, "abbe": found.abbe}

    def note(self, text: str) -> None:
        """Add a note, once."""
        if text not in self.notes:
            self.notes.append(text)

    def _note_maker(self, name: str, entry: NamedGlass) -> None:
        """Note a glass of a maker that neither its name nor the file says, since makers share names."""
        named = [maker for maker in self.makers if maker in glasses_by_maker()]
        is_of_prefix = "-" in name and glass_key(name) == glass_key(entry.name)
        is_usual = entry.maker == "MISC" or (entry.maker == SCHOTT and not named)
        if entry.is_named_maker or is_of_prefix or is_usual:
            return
        maker = entry.maker if entry.maker == "CDGM" else entry.maker.title()
        why = f", because the file's {' and '.join(named)} lacks it" if named else ""
        self.note(f"the glass {name} is read as {entry.name} of {maker}, index {entry.glass.index:g}{why}")

    def _computed(self, catalogue: Catalogue, name: str, entry: CatalogueGlass) -> Glass:
        place = _place(catalogue, entry)
        if entry.problem is None and not entry.is_visible:
            least, most = entry.range_um or (0.0, 0.0)
            raise wrong(place, FOR_VISIBLE_LIGHT, f"one from {least:g} to {most:g} micrometres")
        try:
            made = entry.glass()
        except SpecError as error:
            raise SpecError.of(
                FieldProblem(field=f"{catalogue.title}, {problem.field}", expected=problem.expected, got=problem.got)
                for problem in error.problems
            ) from error
        if entry.has_temperature:
            self.note(f"{catalogue.title}: the temperature data is ignored; a glass is at the catalogue's temperature")
        if entry.index > 0 and abs(entry.index - made.index) > 1e-3:
            self.note(
                f"{place}: the index by its formula, {made.index:.5f}, is used, and not the "
                f"{entry.index:g} beside its name"
            )
        return made


def makers_of(catalogues: Sequence[str]) -> Iterator[str]:
    """Yield the makers of the built-in table in the names of catalogues, in their order.

    Parameters
    ----------
    catalogues
        The names, some of which have a date or a second word.

    Examples
    --------
    >>> list(makers_of(["SUMITA_AUG2011", "NIKON-HIKARI", "INFRARED", "hoya20200314"]))
    ['SUMITA', 'HIKARI', 'HOYA']
    """
    for catalogue in catalogues:
        yield from (word for word in _LETTERS.findall(catalogue.upper()) if word in glasses_by_maker())


def coded_glass(code: str) -> Glass | None:
    """Return the glass of a six-digit code, or of one with a point; None for other texts.

    Parameters
    ----------
    code
        The text.

    Examples
    --------
    >>> coded_glass("517642"), coded_glass("517000.520000")
    (Glass(index=1.517, abbe=64.2), Glass(index=1.517, abbe=52.0))
    """
    if found := _CODE.fullmatch(code):
        index, abbe = 1.0 + int(found[1]) / 1000, int(found[2]) / 10
    elif found := _DOTTED_CODE.fullmatch(code):
        index, abbe = 1.0 + float(f"0.{found[1]}"), round(100 * float(f"0.{found[2]}"), 6)
    else:
        return None
    return Glass(index=index, abbe=abbe) if abbe >= 1.0 and index > 1.0 else None


def _in_catalogue(catalogue: Catalogue, name: str) -> CatalogueGlass | None:
    found = catalogue.glasses.get(name.upper()) or catalogue.by_key.get(glass_key(name))
    before, separator, maker = name.rpartition("_")
    if found is None and separator and catalogue.title.upper().startswith(maker.upper()):
        found = catalogue.by_key.get(glass_key(before))
    return found


def _place(catalogue: Catalogue, entry: CatalogueGlass) -> str:
    return f"{catalogue.title}, {entry.place}"
