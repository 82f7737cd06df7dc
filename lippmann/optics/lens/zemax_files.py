"""Lens designs of Zemax: the surfaces of a sequential .zmx file.

The reader uses UNIT, NAME and, in every SURF, TYPE, CURV, DISZ, GLAS, DIAM, CLAP, CONI, PARM and STOP. It ignores what
does not affect rays: fields, wavelengths, solves, coatings, merit functions. The first surface is the object and the
last one the image. What cannot be modelled is refused with its line number.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NoReturn

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.glasses import GLASSES, glass
from lippmann.job.lens import Prescription
from lippmann.job.rig import MM_PER_INCH
from lippmann.optics.lens.rows import Row, prescription_of_rows
from lippmann.untrusted.text_lines import read_lines

MM_PER_UNIT = {"MM": 1.0, "CM": 10.0, "IN": MM_PER_INCH, "METER": 1000.0, "M": 1000.0}
TYPES = ("STANDARD", "EVENASPH")
MODEL_GLASS = "___BLANK"
NO_GLASS = {"MIRROR": "a surface that refracts: mirrors cannot be modelled", "GRIN": "a homogeneous glass"}


@dataclass(frozen=True)
class _Line:
    number: int
    word: str
    values: tuple[str, ...]

    def refuse(self, expected: str, got: str | None = None) -> NoReturn:
        place = f"line {self.number}, {self.word}"
        shown = " ".join(self.values) if got is None else got
        raise SpecError.of([FieldProblem(field=place, expected=expected, got=shown or "nothing")])

    def value(self, place: int = 0) -> float:
        try:
            value = float(self.values[place])
        except (IndexError, ValueError):
            self.refuse("a number")
        # An object or an image may lie at infinity.
        if math.isnan(value) or (math.isinf(value) and self.word != "DISZ"):
            self.refuse("a finite number")
        return value


@dataclass
class _Block:
    """The lines of one SURF."""

    start: _Line
    lines: list[_Line] = field(default_factory=list)

    def first(self, word: str) -> _Line | None:
        return next((line for line in self.lines if line.word == word), None)

    def number(self, word: str, *, otherwise: float = 0.0) -> float:
        line = self.first(word)
        return otherwise if line is None else line.value()


def read_lens_zmx(text: str) -> Prescription:
    """Return the prescription in the text of a .zmx file.

    Raises
    ------
    InvalidText
        If the text has too many lines.
    SpecError
        The error names the line, the field, the expected value and the value received.
    """
    head, blocks = _blocks(_lines(text))
    if len(blocks) < 3:
        raise SpecError(f"expected a .zmx file with an object, surfaces and an image, got {len(blocks)} SURF blocks")
    mm = _mm_per_unit(head)
    rows = [_row(block, mm) for block in blocks[1:-1]]
    # In a few files the stop is the object or the image; its position in the lens is then unknown.
    name = head.first("NAME")
    return prescription_of_rows(rows, title=" ".join(name.values)[:200] if name else "")


def _lines(text: str) -> Iterator[_Line]:
    for number, line in read_lines(text):
        word, *values = line.split() or [""]
        if word:
            yield _Line(number, word.upper(), tuple(values))


def _blocks(lines: Iterator[_Line]) -> tuple[_Block, list[_Block]]:
    head = _Block(_Line(1, "", ()))
    blocks: list[_Block] = []
    for line in lines:
        if line.word == "SURF":
            blocks.append(_Block(line))
        elif line.word == "MODE" and line.values[:1] != ("SEQ",):
            line.refuse("SEQ: a sequential system")
        else:
            (blocks[-1] if blocks else head).lines.append(line)
    return head, blocks


def _mm_per_unit(head: _Block) -> float:
    unit = head.first("UNIT")
    if unit is None:
        return 1.0
    if not unit.values or unit.values[0].upper() not in MM_PER_UNIT:
        unit.refuse(f"one of {', '.join(MM_PER_UNIT)}")
    return MM_PER_UNIT[unit.values[0].upper()]


def _row(block: _Block, mm: float) -> Row:
    kind = block.first("TYPE")
    if kind is not None and (not kind.values or kind.values[0].upper() not in TYPES):
        kind.refuse(f"one of {', '.join(TYPES)}; other surfaces cannot be modelled")
    curvature = block.number("CURV")
    distance = block.number("DISZ")
    if math.isinf(distance):
        _refuse(block, "DISZ", "a finite distance")
    surface: dict[str, Any] = {
        "radius_mm": mm / curvature if curvature else None,
        "thickness_mm": distance * mm,
        "conic": block.number("CONI"),
        "aspheric": _aspheric(block, mm) if kind is not None and kind.values[0].upper() == "EVENASPH" else (),
        **_medium(block),
    }
    aperture = _semi_aperture(block)
    bends = surface["radius_mm"] is not None or surface["aspheric"] or surface["index"] != 1.0
    if aperture > 0:
        surface["semi_aperture_mm"] = aperture * mm
    elif bends:
        _refuse(block, "DIAM", "a semi-diameter above 0 (in the design program: fix the semi-diameters)")
    place = f"line {block.start.number}, SURF {' '.join(block.start.values)}"
    return Row(place, surface, is_stop=block.first("STOP") is not None)


def _refuse(block: _Block, word: str, expected: str) -> NoReturn:
    line = block.first(word)
    if line is not None:
        line.refuse(expected, line.values[0] if line.values else None)
    _Line(block.start.number, f"SURF {' '.join(block.start.values)}, {word}", ()).refuse(expected)


def _semi_aperture(block: _Block) -> float:
    """Return the semi-diameter, or else the radius of a circular aperture; 0 if both are unknown."""
    size = block.number("DIAM")
    clear = block.first("CLAP")
    return clear.value(1) if size <= 0 and clear is not None else size


def _aspheric(block: _Block, mm: float) -> tuple[float, ...]:
    """Return the coefficients of r^4, r^6, ... in mm; PARM n is that of r^(2n)."""
    terms = [0.0] * 7
    for line in block.lines:
        if line.word != "PARM" or line.value(1) == 0.0:
            continue
        order = int(line.value(0))
        if not 2 <= order <= 8:
            line.refuse("terms of r^4 to r^16, PARM 2 to 8; a term of r^2 belongs into the curvature")
        terms[order - 2] = line.value(1) / mm ** (2 * order - 1)
    while terms and terms[-1] == 0.0:
        terms.pop()
    return tuple(terms)


def _medium(block: _Block) -> dict[str, Any]:
    line = block.first("GLAS")
    if line is None or not line.values:
        return {"index": 1.0}
    name = line.values[0].upper()
    if name in NO_GLASS:
        line.refuse(NO_GLASS[name], name)
    known = glass(name)
    if known is not None:
        return {"material": line.values[0], "index": known.index, "abbe": known.abbe}
    is_model = name == MODEL_GLASS or (len(line.values) > 1 and line.values[1] == "1")
    if not is_model:
        line.refuse(f"a model glass ({MODEL_GLASS} 1 0 nd Vd), or one of {', '.join(GLASSES)}", name)
    abbe = line.value(4) if len(line.values) > 4 else 0.0
    return {"index": line.value(3), "abbe": abbe or None}
