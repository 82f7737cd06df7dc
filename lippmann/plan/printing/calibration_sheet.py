"""A sheet that measures the true pitch of an array on a device, by strips of lines of slightly different pitches.

Under the array, an eye sees one place under each lens. Over a strip whose lines have the array's pitch it is the same
place of every line, so the strip is even, and turns from black to white all at once as the eye moves. Over any other
strip the places move on from lens to lens, and bands run along: the moire of array and lines, whose period is
p q / |p - q| for lenses p and lines q apart. The longer the bands, the nearer the pitch.

An eye at a distance L from lenses that stand the reduced gap g before the paper sees, under a lens x from the point
opposite to it, the place x (1 + g / L): the strip that it finds even is the one of p (1 + g / L).

On the hexagonal lattice every other row is half a pitch further, so lines across stand half a pitch apart, and lines
down stand as far apart as lens rows. Lines begin and end on pixels of the device, each within half a pixel of its
place; the error does not add up.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from lippmann.job.optics.rig import MM_PER_INCH, Rig
from lippmann.job.outputs.prints import CalibrationSheet
from lippmann.lattice.cell import Lattice
from lippmann.lattice.kinds import CELLS
from lippmann.plan.printing.shapes import Bar, Shape, TextLine

Direction = Literal["across", "down"]
"""The direction in which the pitch is measured: `across` has vertical lines, `down` has horizontal ones."""

DIRECTIONS: tuple[Direction, ...] = ("across", "down")

BORDER_MM = 8.0
HEAD_MM = 13.0
HEAD_WIDTH_MM = 150.0
"""The height of the text above the strips."""
GAP_MM = 1.0
"""The distance between strips."""
NAMES_MM = {"across": 27.0, "down": 6.0}
"""The room for the names of strips, beside or above them."""
HEAD_SIZE_MM, NAME_SIZE_MM, SMALL_SIZE_MM = 3.0, 2.2, 1.5


@dataclass(frozen=True)
class Strip:
    """A strip of lines of one pitch, in mm from the upper left corner of the page."""

    pitch_mm: float
    """The pitch of the lenses under which the strip looks even."""
    change_percent: float
    """The difference from the nominal pitch."""
    left_mm: float
    top_mm: float
    width_mm: float
    height_mm: float


@dataclass(frozen=True)
class CalibrationPage:
    """The page for one direction."""

    direction: Direction
    rows: int
    cols: int
    """The rows of the page, in pixels of the device."""
    pixel_mm: float
    strips: tuple[Strip, ...]
    shapes: tuple[Shape, ...]


def calibration_page(output: CalibrationSheet, rig: Rig, direction: Direction) -> CalibrationPage:
    """Lay out a page of a calibration sheet.

    Raises
    ------
    FieldError
        If the pixels of the device are unknown.
    """
    pixel_mm, pitch_mm = output.pixel_mm(rig), output.real_pitch_mm(rig)
    strips = tuple(_strips(output, pitch_mm, direction, pixel_mm))
    wide_mm, high_mm = page_mm(output, direction)
    period = line_period(rig.lens_array.lattice, direction)
    shapes: list[Shape] = [*_head(output, rig, direction, pitch_mm, pixel_mm)]
    for strip in strips:
        shapes += _named(strip, direction)
        shapes += _lines(strip, direction, strip.pitch_mm * period, pixel_mm)
    rows, cols = (math.ceil(side / pixel_mm) for side in (high_mm, wide_mm))
    return CalibrationPage(direction, rows, cols, pixel_mm, strips, tuple(shapes))


def page_mm(output: CalibrationSheet, direction: Direction) -> tuple[float, float]:
    """Return the (width, height) of a page."""
    along, beside = output.length_mm, output.steps * (output.strip_mm + GAP_MM)
    wide, high = (along, beside) if direction == "across" else (beside, along)
    if direction == "across":
        wide += NAMES_MM["across"]
    else:
        high += NAMES_MM["down"]
    return 2 * BORDER_MM + max(wide, HEAD_WIDTH_MM), 2 * BORDER_MM + HEAD_MM + high


def line_period(lattice: Lattice, direction: Direction) -> float:
    """Return the distance of lines, in lens pitches."""
    return 1 / CELLS[lattice].row_period if direction == "across" else CELLS[lattice].row_pitch


def moire_mm(lens_pitch_mm: float, strip_pitch_mm: float) -> float:
    """Return the period of the moiré bands for a distant eye, mm; it is infinite over the true strip.

    >>> round(moire_mm(1.0, 1.0025), 1), moire_mm(1.0, 1.0)
    (401.0, inf)
    """
    apart_mm = abs(lens_pitch_mm - strip_pitch_mm)
    return lens_pitch_mm * strip_pitch_mm / apart_mm if apart_mm else math.inf


def _strips(output: CalibrationSheet, pitch_mm: float, direction: Direction, pixel_mm: float) -> Iterator[Strip]:
    step = 2 * output.range_percent / (output.steps - 1)
    for number in range(output.steps):
        change = round(number * step - output.range_percent, 9)
        beside_mm = number * (output.strip_mm + GAP_MM)
        if direction == "across":
            place = BORDER_MM + NAMES_MM["across"], BORDER_MM + HEAD_MM + beside_mm
            size = output.length_mm, output.strip_mm
        else:
            place = BORDER_MM + beside_mm, BORDER_MM + HEAD_MM + NAMES_MM["down"]
            size = output.strip_mm, output.length_mm
        left, top, wide, high = (round(number / pixel_mm) * pixel_mm for number in (*place, *size))
        yield Strip(pitch_mm * (1 + change / 100), change, left, top, wide, high)


def _lines(strip: Strip, direction: Direction, period_mm: float, pixel_mm: float) -> Iterator[Bar]:
    """Yield the lines of a strip, each half a period wide, on whole pixels."""
    start_mm, long_mm = (strip.left_mm, strip.width_mm) if direction == "across" else (strip.top_mm, strip.height_mm)
    # A strip may have been rounded down to whole pixels, below as many lines as it was to have.
    for number in range(math.floor((long_mm + pixel_mm) / period_mm)):
        first, stop = (round((start_mm + (number + part) * period_mm) / pixel_mm) * pixel_mm for part in (0.0, 0.5))
        if direction == "across":
            yield Bar(first, strip.top_mm, stop - first, strip.height_mm)
        else:
            yield Bar(strip.left_mm, first, strip.width_mm, stop - first)


def _named(strip: Strip, direction: Direction) -> Iterator[TextLine]:
    change, pitch = f"{strip.change_percent:{'+.3g' if strip.change_percent else 'g'}} %", f"{strip.pitch_mm:.6g}"
    if direction == "across":
        baseline_mm = strip.top_mm + strip.height_mm / 2 + NAME_SIZE_MM / 3
        yield TextLine(BORDER_MM, baseline_mm, NAME_SIZE_MM, f"{pitch} mm")
        yield TextLine(BORDER_MM + 16, baseline_mm, NAME_SIZE_MM, change)
    else:
        middle_mm = strip.left_mm + strip.width_mm / 2
        yield TextLine(middle_mm, strip.top_mm - 3, SMALL_SIZE_MM, change, centred=True)
        yield TextLine(middle_mm, strip.top_mm - 1, SMALL_SIZE_MM, pitch, centred=True)


def _head(
    output: CalibrationSheet, rig: Rig, direction: Direction, pitch_mm: float, pixel_mm: float
) -> Iterator[TextLine]:
    lattice = rig.lens_array.lattice
    yield TextLine(
        BORDER_MM,
        BORDER_MM + HEAD_SIZE_MM,
        HEAD_SIZE_MM,
        f"Calibration sheet, {direction}: lens pitch {pitch_mm:.6g} mm, {lattice}, {MM_PER_INCH / pixel_mm:.6g} dpi",
    )
    told = (
        "Print at 100 %. Lay the array on the sheet, its edges along the lines, look from far away and move your head.",
        "The strip that turns black and white all at once has the array's pitch; over the others, bands run along.",
    )
    for number, text in enumerate(told):
        yield TextLine(BORDER_MM, BORDER_MM + HEAD_SIZE_MM + 3.2 * (number + 1), NAME_SIZE_MM, text)
