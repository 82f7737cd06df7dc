"""Lens designs of Zemax: the surfaces of a sequential .zmx file.

The reader uses UNIT, NAME, GCAT and, in every SURF, TYPE, CURV, DISZ, GLAS, DIAM, CLAP, CONI, PARM and STOP. Aperture
and field (ENPD, FNUM, OBNA, FLOA, FTYP, XFLN, YFLN) give the semi-diameters that are absent. It ignores what does not
affect rays: solves, coatings, merit functions. The first surface is the object and the last one the image. What cannot
be modelled is refused with its line number.
"""

from __future__ import annotations

import math
from typing import Any

from lippmann.errors import SpecError
from lippmann.job.optics.glasses import Glass
from lippmann.job.optics.rig import MM_PER_INCH
from lippmann.optics.lens_files.glasses.search import AIR, GAS, GlassSearch, makers_of
from lippmann.optics.lens_files.lens_file import LensFile
from lippmann.optics.lens_files.lines import Line
from lippmann.optics.lens_files.rows import Row, prescription_of_rows, radius_or_plane
from lippmann.optics.lens_files.semi_apertures import with_semi_apertures
from lippmann.optics.lens_files.zemax.aspheres import profile_of
from lippmann.optics.lens_files.zemax.lines import Block, read_blocks
from lippmann.optics.lens_files.zemax.system import notes_of, system_of

MM_PER_UNIT = {"MM": 1.0, "CM": 10.0, "IN": MM_PER_INCH, "METER": 1000.0, "M": 1000.0}
TYPES = ("STANDARD", "EVENASPH")
OTHER_APERTURES = ("SQAP", "ELAP", "UDAD", "OBSC", "SQOB", "ELOB", "SPID", "OBDC")
"""Apertures and obscurations that are not round, or not about the axis."""
MODEL_GLASS = "___BLANK"
NO_GLASS = {"MIRROR": "a surface that refracts: mirrors cannot be modelled", "GRIN": "a homogeneous glass"}
PLACEHOLDERS = ((1.5, 40.0), (1.0, 0.0), (0.0, 0.0))
"""The index and the Abbe number that Zemax writes behind the name of a glass from a catalogue."""


def read_lens_zmx(text: str, glasses: GlassSearch | None = None) -> LensFile:
    """Return the lens in the text of a .zmx file.

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
        The error names the line, the field, the expected value and the value received.
    """
    head, blocks = read_blocks(text)
    if len(blocks) < 3:
        raise SpecError(f"expected a .zmx file with an object, surfaces and an image, got {len(blocks)} SURF blocks")
    mm = _mm_per_unit(head)
    search = GlassSearch() if glasses is None else glasses
    makers = head.first("GCAT")
    search.makers = (*search.makers, *makers_of(makers.values if makers else ()))
    object_mm = blocks[0].distance(otherwise=math.inf) * mm
    # In a few files the stop is the object or the image; its position in the lens is then unknown.
    rows = [_row(block, mm, search) for block in blocks[1:-1]]
    apertures = [note for note in map(_aperture_note, blocks[1:-1]) if note]
    rows, computed = with_semi_apertures(
        rows, system_of(head, object_mm=object_mm, mm=mm), words="DIAM; ENPD, FNUM, OBNA, FLOA"
    )
    name = head.first("NAME")
    title = " ".join(name.values)[:200] if name else ""
    return prescription_of_rows(rows, title=title, notes=[*search.notes, *notes_of(head), *apertures, *computed])


def _mm_per_unit(head: Block) -> float:
    unit = head.first("UNIT")
    if unit is None:
        return 1.0
    if not unit.values or unit.values[0].upper() not in MM_PER_UNIT:
        unit.refuse(f"one of {', '.join(MM_PER_UNIT)}")
    return MM_PER_UNIT[unit.values[0].upper()]


def _row(block: Block, mm: float, glasses: GlassSearch) -> Row:
    kind = block.first("TYPE")
    if kind is not None and (not kind.values or kind.values[0].upper() not in TYPES):
        kind.refuse(f"one of {', '.join(TYPES)}; other surfaces cannot be modelled")
    distance = block.distance()
    if math.isinf(distance):
        block.refuse("DISZ", "a finite distance")
    aperture = _semi_aperture(block)
    is_even_asphere = kind is not None and kind.values[0].upper() == "EVENASPH"
    profile = profile_of(block, mm=mm, is_even_asphere=is_even_asphere, semi_mm=max(0.0, aperture * mm))
    curvature_per_mm = profile.curvature_per_mm
    surface: dict[str, Any] = {
        "radius_mm": radius_or_plane(1.0 / curvature_per_mm if curvature_per_mm else math.inf),
        "thickness_mm": distance * mm,
        "conic": profile.conic,
        "aspheric": profile.aspheric,
        **_medium(block, glasses),
    }
    if aperture > 0:
        surface["semi_aperture_mm"] = aperture * mm
    return Row(block.place, surface, is_stop=block.first("STOP") is not None, may_shrink=_is_automatic(block))


def _semi_aperture(block: Block) -> float:
    """Return the radius of a circular aperture, which stops light, or else the semi-diameter; 0 if both are unknown."""
    clear = block.first("CLAP")
    return (0.0 if clear is None else clear.value(1)) or block.number("DIAM")


def _is_automatic(block: Block) -> bool:
    """Return whether Zemax computed the semi-diameter: it writes 0 behind it, and 1 behind one of its user."""
    size = block.first("DIAM")
    return block.first("CLAP") is None and size is not None and size.values[1:2] == ("0",)


def _aperture_note(block: Block) -> str:
    """Return the note for a block whose aperture is more than a circle; empty for all others."""
    clear = block.first("CLAP")
    ignored = [word for word in OTHER_APERTURES if any(number != 0 for number in block.numbers(word)[:2])]
    if clear is not None and clear.value(0) > 0:
        ignored.insert(0, "the hole of CLAP")
    if not ignored:
        return ""
    return f"{block.place}: it is modelled with one round aperture, without {' and '.join(ignored)}"


def _medium(block: Block, glasses: GlassSearch) -> dict[str, Any]:
    line = block.first("GLAS")
    if line is None or not line.values or line.values[0].upper() in AIR:
        return {"index": 1.0}
    name = line.values[0].upper()
    if name in NO_GLASS:
        line.refuse(NO_GLASS[name], name)
    is_model = name == MODEL_GLASS or (len(line.values) > 1 and line.values[1] == "1")
    known = None if name == MODEL_GLASS else glasses.find(name)
    if known is not None:
        return glasses.medium(block.place, line.values[0], known)
    found = Glass(line.value(3), _abbe(line)) if is_model else _glass_of_line(block, line, glasses)
    return glasses.medium(block.place, "", found)


def _glass_of_line(block: Block, line: Line, glasses: GlassSearch) -> Glass:
    """Return the index and the Abbe number behind an unknown name, unless they are placeholders."""
    name = line.values[0]
    numbers = (line.value(3), line.value(4)) if len(line.values) > 4 else (0.0, 0.0)
    if numbers in PLACEHOLDERS or not numbers[0] > 1.0 - GAS:
        behind = f"; the numbers behind the name, {numbers[0]:g} {numbers[1]:g}, are placeholders"
        line.refuse(f"{glasses.expected(name)}", f"{name[:100]}{behind if len(line.values) > 4 else ''}")
    glasses.note(
        f"{block.place}: the glass {name[:100]} is unknown; its numbers in the file are used, index {numbers[0]:g} and "
        f"Abbe number {numbers[1]:g}"
    )
    return Glass(numbers[0], _abbe(line))


def _abbe(line: Line) -> float | None:
    abbe = line.value(4) if len(line.values) > 4 else 0.0
    return abbe if abbe > 0 else None
