"""Lens designs as CSV: one surface per line, `radius;thickness;material;index;v-no;sa`, in mm, object side first."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from lippmann.optics.lens_files.glasses.search import GlassSearch
from lippmann.optics.lens_files.lens_file import LensFile
from lippmann.optics.lens_files.lines import wrong
from lippmann.optics.lens_files.rows import Row, prescription_of_rows, radius_or_plane
from lippmann.untrusted.text_lines import read_lines

COLUMNS = ("radius", "thickness", "material", "index", "v-no", "sa")
STOP = "STOP"
AIR = ("", "AIR")


def read_lens_csv(text: str, glasses: GlassSearch | None = None, *, title: str = "") -> LensFile:
    r"""Return the lens in a CSV file.

    A line of column names may come first and set their order. `#` begins a comment. A radius that is blank, 0 or
    `inf` is a plane; a blank index without material is air. The row named STOP in its material, or else the one plane
    with air on both sides between the surfaces, is the position of a variable stop. Planes in air before the first
    surface and behind the last are object and image, and are ignored.

    Parameters
    ----------
    text
        The content of the file.
    glasses
        Where glasses without an index are looked up; by default in the built-in table.
    title
        The title of the lens.

    Raises
    ------
    InvalidText
        If the text has too many lines.
    SpecError
        The error names the line, the field, the expected value and the value received.

    Examples
    --------
    >>> lens = read_lens_csv("50;5;BK7;;;10\n-50;;;;;10").prescription
    >>> lens.surfaces[0].index, lens.surfaces[1].radius_mm
    (1.5168, -50.0)
    """
    search = GlassSearch() if glasses is None else glasses
    found = [Row(place, _surface(place, cells, search), _is_stop(cells)) for place, cells in _cells(text)]
    rows = _without_ends(found)
    for row in rows:
        if math.isinf(row.surface["thickness_mm"]):
            raise wrong(f"{row.place}, thickness", "a finite number", repr("inf"))
    in_air = _are_planes_in_air(rows)
    for row, fits in zip(rows, in_air, strict=True):
        if row.is_stop and not fits:
            raise wrong(f"{row.place}, material", "a stop as a plane with air on both sides", "a stop elsewhere")
    if not any(row.is_stop for row in rows):
        rows = [replace(row, is_stop=fits) for row, fits in zip(rows, in_air, strict=True)]
    return prescription_of_rows(rows, title=title, notes=search.notes)


def _without_ends(rows: list[Row]) -> list[Row]:
    """Return the rows without object and image: planes in air at both ends, except one that is named the stop."""
    in_air = _are_planes_in_air(rows)
    kept = [place for place, row in enumerate(rows) if row.is_stop or not in_air[place]]
    return rows[kept[0] : kept[-1] + 1] if kept else []


def _are_planes_in_air(rows: list[Row]) -> list[bool]:
    return [
        before == 1.0 and _is_plane_in_air(row.surface) for row, before in zip(rows, _indices_before(rows), strict=True)
    ]


def _cells(text: str) -> Iterator[tuple[str, Mapping[str, str]]]:
    columns: tuple[str, ...] = COLUMNS
    seen = False
    for number, line in read_lines(text):
        cells = [cell.strip() for cell in line.partition("#")[0].split(";")]
        if not any(cells):
            continue
        if not seen and cells[0].lower() in COLUMNS:
            columns, seen = _header(number, cells), True
            continue
        seen = True
        while len(cells) > len(columns) and not cells[-1]:
            cells.pop()
        if len(cells) != len(columns):
            got = f"{len(cells)} ({line.strip()[:60]})"
            raise wrong(f"line {number}", f"{len(columns)} cells, {';'.join(columns)}", got)
        yield f"line {number}", dict(zip(columns, cells, strict=True))


def _header(number: int, cells: list[str]) -> tuple[str, ...]:
    names = tuple(cell.lower() for cell in cells if cell)
    if set(names) != set(COLUMNS) or len(names) != len(COLUMNS):
        raise wrong(f"line {number}", f"the columns {';'.join(COLUMNS)}", ";".join(names))
    return names


def _surface(place: str, cells: Mapping[str, str], glasses: GlassSearch) -> dict[str, Any]:
    radius_mm = _number(place, "radius", cells, blank=0.0)
    surface: dict[str, Any] = {
        "radius_mm": radius_or_plane(radius_mm or math.inf),
        "thickness_mm": _number(place, "thickness", cells, blank=0.0),
    }
    material = "" if _is_stop(cells) else cells["material"]
    if material.upper() not in AIR:
        surface["material"] = material
    if cells["index"] or material.upper() in AIR:
        surface["index"] = _number(place, "index", cells, blank=1.0)
    elif known := glasses.find(material):
        surface |= {"index": known.index, "abbe": known.abbe}
    if cells["v-no"]:
        surface["abbe"] = _number(place, "v-no", cells, blank=0.0)
    if cells["sa"]:
        surface["semi_aperture_mm"] = _number(place, "sa", cells, blank=0.0)
    return surface


def _number(place: str, name: str, cells: Mapping[str, str], *, blank: float) -> float:
    cell = cells[name]
    if not cell:
        return blank
    if "," in cell:
        raise wrong(f"{place}, {name}", "a number with a decimal point", f"{cell!r} with a comma")
    try:
        value = float(cell)
    except ValueError:
        raise wrong(f"{place}, {name}", "a number", repr(cell)) from None
    if math.isnan(value) or (math.isinf(value) and name not in ("radius", "thickness")):
        raise wrong(f"{place}, {name}", "a finite number", repr(cell))
    return value


def _is_stop(cells: Mapping[str, str]) -> bool:
    return cells["material"].upper() == STOP


def _is_plane_in_air(surface: Mapping[str, Any]) -> bool:
    return surface["radius_mm"] is None and surface.get("index") == 1.0 and "material" not in surface


def _indices_before(rows: list[Row]) -> list[float]:
    # A material without an index is some glass.
    return [1.0, *(row.surface.get("index", 0.0) for row in rows)][: len(rows)]
