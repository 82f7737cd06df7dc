"""Glass catalogues in the AGF format: nd and Vd of every glass, from its dispersion formula.

The reader uses NM (name, formula, nd, Vd), CD (coefficients) and LD (range of wavelengths). It ignores prices,
transmission and the temperature data (TD): a glass has its index at the temperature of the catalogue.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from lippmann.errors import SpecError
from lippmann.job.optics.glasses import Glass, glass_key
from lippmann.optics.lens.dispersion import LINE_C_NM, LINE_D_NM, LINE_F_NM
from lippmann.optics.lens_files.glasses.dispersion import FORMULA_NAMES, MOST_COEFFICIENTS, refractive_index
from lippmann.optics.lens_files.lines import finite_number, wrong
from lippmann.untrusted.shown import shown
from lippmann.untrusted.text_lines import read_lines

MAX_GLASSES = 5000
MAX_INDEX = 4.0
SHOWN = 8
"""The glasses that a note names."""


@dataclass
class CatalogueGlass:
    """A glass of a catalogue, as the lines of the file give it."""

    place: str
    """The words that name the glass in a message, for example `line 7, NM N-BK7`."""
    name: str = ""
    formula: int = 0
    index: float = 0.0
    """The nd of the NM line, for comparison; 0 if the line has none."""
    coefficients: tuple[float, ...] = ()
    range_um: tuple[float, float] | None = None
    """The wavelengths for which the formula holds."""
    problem: SpecError | None = None
    """The first of its lines that cannot be read; None for a whole glass."""
    has_temperature: bool = False
    """True if the catalogue gives temperature data, which is not used."""

    def glass(self) -> Glass:
        """Return nd and Vd by the formula.

        Raises
        ------
        SpecError
            If a line of the glass cannot be read, or the formula is unknown or gives no index for visible light.
        """
        if self.problem is not None:
            raise self.problem
        if self.formula not in FORMULA_NAMES:
            known = ", ".join(f"{number} ({name})" for number, name in FORMULA_NAMES.items())
            raise wrong(self.place, f"a dispersion formula of {known}", str(self.formula))
        blue, yellow, red = (self._index(line_nm / 1000) for line_nm in (LINE_F_NM, LINE_D_NM, LINE_C_NM))
        if not 1.0 <= yellow <= MAX_INDEX:
            how = FORMULA_NAMES[self.formula]
            got = f"{yellow:.6g} by the formula {how}" if math.isfinite(yellow) else f"none by the formula {how}"
            raise wrong(self.place, f"an index from 1 to {MAX_INDEX:g} at 587.6 nm", got)
        # A glass whose formula does not reach the lines F and C has no Abbe number, and one of 1 or less is no glass.
        abbe = (yellow - 1.0) / (blue - red) if blue > red and self._reaches(LINE_F_NM, LINE_C_NM) else 0.0
        return Glass(index=yellow, abbe=abbe if 1.0 <= abbe <= 1000.0 else None)

    def _index(self, wavelength_um: float) -> float:
        return refractive_index(self.formula, self.coefficients, wavelength_um)

    def _reaches(self, *lines_nm: float) -> bool:
        if self.range_um is None:
            return True
        least, most = self.range_um
        return all(least <= line_nm / 1000 <= most for line_nm in lines_nm)

    @property
    def is_visible(self) -> bool:
        """True if the formula holds at 587.6 nm."""
        return self._reaches(LINE_D_NM)


@dataclass(frozen=True)
class Catalogue:
    """The glasses of a catalogue."""

    title: str
    """The name of the catalogue, for messages."""
    glasses: Mapping[str, CatalogueGlass] = field(default_factory=dict)
    """The glasses by their names in capital letters."""
    note: str = ""
    """The glasses that cannot be read, if there are any."""

    @cached_property
    def by_key(self) -> Mapping[str, CatalogueGlass]:
        """The glasses by their names without hyphens, as CODE V writes them."""
        return {glass_key(name): one for name, one in self.glasses.items()}


def read_agf(text: str, *, title: str = "") -> Catalogue:
    r"""Return the glasses of the text of a catalogue.

    A glass is computed when it is used, so one with an unknown formula or a line that cannot be read does no harm to
    the others.

    Parameters
    ----------
    text
        The content of the file.
    title
        The name of the catalogue, for messages.

    Raises
    ------
    InvalidText
        If the text has too many lines, or too long ones.
    SpecError
        If no glass can be read. The error names the line, the field, the expected value and the value received.

    Examples
    --------
    >>> catalogue = read_agf("NM MINE 5 0 1.5 50\nCD 1.5 0.01 0.0\nLD 0.3 2.5")
    >>> round(catalogue.glasses["MINE"].glass().index, 6)
    1.517019
    """
    glasses: dict[str, CatalogueGlass] = {}
    current: CatalogueGlass | None = None
    for number, line in read_lines(text):
        word, *values = line.split() or [""]
        place = f"line {number}, {word.upper()}"
        if word.upper() == "NM":
            name = values[0].upper()[:100] if values else ""
            current = CatalogueGlass(place=f"{place} {name}".rstrip(), name=name)
            glasses.setdefault(name, current)
            if len(glasses) > MAX_GLASSES:
                raise wrong(place, f"at most {MAX_GLASSES:,} glasses", "more")
        if current is not None:
            try:
                _take_line(current, place, word.upper(), values)
            except SpecError as error:
                current.problem = current.problem or error
    unreadable = [one for one in glasses.values() if one.problem is not None]
    if len(unreadable) == len(glasses):
        raise (unreadable[0].problem if unreadable else None) or wrong(
            "(whole)", "a catalogue with NM lines", "no NM line"
        )
    return Catalogue(title, glasses, _note(title, unreadable))


def _take_line(glass: CatalogueGlass, place: str, word: str, values: Sequence[str]) -> None:
    """Take one line of a glass.

    Parameters
    ----------
    glass
        The glass, which receives the numbers.
    place
        The words that name the line in a message.
    word
        The first word of the line, in capital letters.
    values
        The words behind it.

    Raises
    ------
    SpecError
        If a number cannot be read.
    """
    where = f"{place} of {glass.name}"
    if word == "NM":
        if len(values) < 2:
            raise wrong(place, "a name and the number of a dispersion formula", shown(" ".join(values)))
        glass.formula = _formula(glass.place, values[1])
        glass.index = _number(glass.place, values[3]) if len(values) > 3 else 0.0
    elif word == "CD":
        glass.coefficients = tuple(_number(where, value) for value in values[:MOST_COEFFICIENTS])
    elif word == "LD" and len(values) >= 2:
        glass.range_um = _number(where, values[0]), _number(where, values[1])
    elif word == "TD":
        glass.has_temperature = True


def _note(title: str, unreadable: Sequence[CatalogueGlass]) -> str:
    if not unreadable:
        return ""
    which = ", ".join(one.place for one in unreadable[:SHOWN])
    more = f" and {len(unreadable) - SHOWN} more" if len(unreadable) > SHOWN else ""
    return f"{title}: a glass that has a line that cannot be read is left out: {which}{more}"


def _formula(place: str, text: str) -> int:
    number = _number(place, text)
    if number != int(number):
        raise wrong(place, "the number of a dispersion formula", shown(text))
    return int(number)


def _number(place: str, text: str) -> float:
    value = finite_number(text)
    if value is None:
        raise wrong(place, "a finite number", shown(text))
    return value
