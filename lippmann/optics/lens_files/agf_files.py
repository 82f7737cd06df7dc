"""Glass catalogues in the AGF format: nd and Vd of every glass, from its dispersion formula.

The reader uses NM (name, formula, nd, Vd), CD (coefficients) and LD (range of wavelengths). It ignores prices,
transmission and the temperature data (TD): a glass has its index at the temperature of the catalogue.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.glasses import Glass, glass_key
from lippmann.optics.lens.dispersion import LINE_C_NM, LINE_D_NM, LINE_F_NM
from lippmann.optics.lens_files.dispersion import FORMULA_NAMES, MOST_COEFFICIENTS, refractive_index
from lippmann.untrusted.shown import shown
from lippmann.untrusted.text_lines import read_lines

MAX_GLASSES = 5000
MAX_INDEX = 4.0


@dataclass
class CatalogueGlass:
    """A glass of a catalogue, as the lines of the file give it."""

    place: str
    """The words that name the glass in a message, for example `line 7, NM N-BK7`."""
    formula: int
    index: float
    """The nd of the NM line, for comparison; 0 if the line has none."""
    coefficients: tuple[float, ...] = ()
    range_um: tuple[float, float] | None = None
    """The wavelengths for which the formula holds."""
    has_temperature: bool = False
    """True if the catalogue gives temperature data, which is not used."""

    def glass(self) -> Glass:
        """Return nd and Vd by the formula.

        Raises
        ------
        SpecError
            If the formula is unknown, or gives no index for visible light.
        """
        if self.formula not in FORMULA_NAMES:
            known = ", ".join(f"{number} ({name})" for number, name in FORMULA_NAMES.items())
            raise _wrong(self.place, f"a dispersion formula of {known}", str(self.formula))
        blue, yellow, red = (self._index(line_nm / 1000) for line_nm in (LINE_F_NM, LINE_D_NM, LINE_C_NM))
        if not 1.0 <= yellow <= MAX_INDEX:
            how = FORMULA_NAMES[self.formula]
            got = f"{yellow:.6g} by the formula {how}" if math.isfinite(yellow) else f"none by the formula {how}"
            raise _wrong(self.place, f"an index from 1 to {MAX_INDEX:g} at 587.6 nm", got)
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

    @cached_property
    def by_key(self) -> Mapping[str, CatalogueGlass]:
        """The glasses by their names without hyphens, as CODE V writes them."""
        return {glass_key(name): one for name, one in self.glasses.items()}


def read_agf(text: str, *, title: str = "") -> Catalogue:
    r"""Return the glasses of the text of a catalogue.

    A glass is computed when it is used, so one with an unknown formula does no harm to the others.

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
        The error names the line, the field, the expected value and the value received.

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
        word = word.upper()
        place = f"line {number}, {word}"
        if word == "NM":
            name, current = _named(number, values)
            glasses.setdefault(name, current)
            if len(glasses) > MAX_GLASSES:
                raise _wrong(place, f"at most {MAX_GLASSES:,} glasses", "more")
        elif current is None:
            continue
        elif word == "CD":
            current.coefficients = tuple(_number(place, value) for value in values[:MOST_COEFFICIENTS])
        elif word == "LD" and len(values) >= 2:
            current.range_um = _number(place, values[0]), _number(place, values[1])
        elif word == "TD":
            current.has_temperature = True
    if not glasses:
        raise SpecError.of([FieldProblem(field="(whole)", expected="a catalogue with NM lines", got="no NM line")])
    return Catalogue(title, glasses)


def _named(number: int, values: list[str]) -> tuple[str, CatalogueGlass]:
    if len(values) < 2:
        raise _wrong(f"line {number}, NM", "a name and the number of a dispersion formula", shown(" ".join(values)))
    name = values[0].upper()[:100]
    place = f"line {number}, NM {name}"
    formula = _number(place, values[1])
    if formula != int(formula):
        raise _wrong(place, "the number of a dispersion formula", shown(values[1]))
    index = _number(place, values[3]) if len(values) > 3 else 0.0
    return name, CatalogueGlass(place, int(formula), index)


def _number(place: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _wrong(place, "a finite number", shown(text))
    return value


def _wrong(place: str, expected: str, got: str) -> SpecError:
    return SpecError.of([FieldProblem(field=place, expected=expected, got=got)])
