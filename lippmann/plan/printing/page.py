"""The page of a print: the place of the array's pixels, and the marks around them.

Places are measured from the upper left corner of the page. The array is in the middle, on whole pixels of the device,
so that each of its pixels is one pixel of the device. It is as wide as its lenses: 90 lenses of 1 mm at 600 dpi are
2125.98 px, so 2126 px are printed and the outermost lenses end 0.01 px inside. Marks are drawn at the ends of lenses,
not of pixels.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from lippmann.job.optics.rig import MM_PER_INCH
from lippmann.job.outputs.prints import LABEL_MM, MARKS_MM, Print
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.device import device_size
from lippmann.plan.printing.shapes import Bar, Ring, Shape, TextLine, line

LINE_MM = 0.1
"""The width of the lines of marks, or one pixel of the device if that is larger."""
GAP_MM = 2.0
"""The distance from the array to the marks."""
RING_MM = 1.5
"""The radius of the ring of a registration mark."""
LABEL_SIZE_MM = 2.2
_LETTER = 0.64
"""The largest average width of a letter, as a share of the size of the font."""


@dataclass(frozen=True)
class PrintPage:
    """A page, in px and mm."""

    rows: int
    cols: int
    """The rows of the whole page."""
    array_rows: int
    array_cols: int
    top_px: int
    left_px: int
    """The place of the pixels of the array on the page."""
    pixel_mm: float
    width_mm: float
    height_mm: float
    """The size of the page: that of its pixels, or that of the sheet of paper."""
    lenses: Bar
    """The outline of the lenses on the page."""
    shapes: tuple[Shape, ...]
    """The marks and the label, which lie in the margin."""


def print_page(layout: CellLayout, output: Print, *, lens_pitch_mm: float, pixel_mm: float, label: str) -> PrintPage:
    """Lay out the page of a print.

    Parameters
    ----------
    layout
        The layout of the orthoscopic integral image.
    output
        The options of the print.
    lens_pitch_mm
        The pitch of the real array.
    pixel_mm
        Pitch of the device's pixels.
    label
        The text below the array, if a label is asked for.
    """
    rows, cols = device_size(layout, px_per_lens_device=lens_pitch_mm / pixel_mm)
    high_mm, wide_mm = layout.lenses_of_pitch(lens_pitch_mm).extent
    edge_x, edge_y = (side * lens_pitch_mm for side in middle_edges(layout))
    if output.mirrored:
        edge_x = -edge_x
    for _ in range(output.orientation_deg // 90):
        rows, cols, high_mm, wide_mm, edge_x, edge_y = cols, rows, wide_mm, high_mm, -edge_y, edge_x
    least_px = math.ceil(output.margin_mm / pixel_mm - 1e-9)
    paper_mm = output.paper_mm(wide_mm, high_mm)
    if paper_mm is None:
        page_rows, page_cols = rows + 2 * least_px, cols + 2 * least_px
        paper_mm = page_cols * pixel_mm, page_rows * pixel_mm
    else:
        page_cols, page_rows = (max(1, round(side / pixel_mm)) for side in paper_mm)
    top_px, left_px = (page_rows - rows) // 2, (page_cols - cols) // 2
    centre = ((left_px + cols / 2) * pixel_mm, (top_px + rows / 2) * pixel_mm)
    marks = _Marks(*centre, wide_mm / 2, high_mm / 2, max(LINE_MM, pixel_mm))
    shapes: list[Shape] = []
    if output.crop_marks:
        shapes += marks.at_corners()
    if output.registration_marks:
        shapes += marks.at_edges(edge_x, edge_y)
    if output.label:
        bottom_mm = centre[1] + high_mm / 2 + output.needed_margin_mm
        shapes.append(_label(label, width_mm=page_cols * pixel_mm, bottom_mm=bottom_mm))
    lenses = Bar(centre[0] - wide_mm / 2, centre[1] - high_mm / 2, wide_mm, high_mm)
    return PrintPage(
        page_rows, page_cols, rows, cols, top_px, left_px, pixel_mm, *paper_mm, lenses=lenses, shapes=tuple(shapes)
    )


def middle_edges(layout: CellLayout) -> tuple[float, float]:
    """Return the place (right, down) of the lens edges nearest to the middle of the array, in pitches from it.

    For hexagons these are a vertical side of a row that is not shifted, and the line half-way between two lens rows.

    >>> middle_edges(CellLayout(90, 90, 8)), middle_edges(CellLayout(5, 3, 8))
    ((0.0, 0.0), (0.5, 0.5))
    """
    high, wide = layout.lenses.extent
    right = layout.lens_cols // 2 + layout.lens_cols % 2 - wide / 2
    # The upper edge of the first lens row lies half the overhang below the uppermost corner.
    edge = layout.lens_rows // 2 + layout.lens_rows % 2 + layout.cell.overhang / 2
    return right, edge * layout.cell.row_pitch - high / 2


@dataclass(frozen=True)
class _Marks:
    """The marks around an array, from its middle (x, y) and half its width and height."""

    x: float
    y: float
    wide: float
    high: float
    line_mm: float

    def at_corners(self) -> Iterator[Bar]:
        near, far = GAP_MM, MARKS_MM
        for y in (self.y - self.high, self.y + self.high):
            yield self._line(self.x - self.wide - far, y, self.x - self.wide - near, y)
            yield self._line(self.x + self.wide + near, y, self.x + self.wide + far, y)
        for x in (self.x - self.wide, self.x + self.wide):
            yield self._line(x, self.y - self.high - far, x, self.y - self.high - near)
            yield self._line(x, self.y + self.high + near, x, self.y + self.high + far)

    def at_edges(self, edge_x: float, edge_y: float) -> Iterator[Bar | Ring]:
        arm, away = (MARKS_MM - GAP_MM) / 2, (MARKS_MM + GAP_MM) / 2
        for side in (-1, 1):
            yield from self._cross(self.x + edge_x, self.y + side * (self.high + away), arm)
            yield from self._cross(self.x + side * (self.wide + away), self.y + edge_y, arm)

    def _cross(self, x: float, y: float, arm: float) -> Iterator[Bar | Ring]:
        yield self._line(x - arm, y, x + arm, y)
        yield self._line(x, y - arm, x, y + arm)
        yield Ring(x, y, RING_MM, self.line_mm)

    def _line(self, x0: float, y0: float, x1: float, y1: float) -> Bar:
        return line(x0, y0, x1, y1, line_mm=self.line_mm)


def _label(text: str, *, width_mm: float, bottom_mm: float) -> TextLine:
    """Return the centred label, with a smaller font if it would be wider than the page."""
    size_mm = min(LABEL_SIZE_MM, (width_mm - 2) / (len(text) * _LETTER))
    return TextLine(width_mm / 2, bottom_mm - LABEL_MM / 3, size_mm, text, centred=True)


def label_of(
    facts: str, output: Print, page_mm: tuple[float, float], *, gap: str, lens_pitch_mm: float, pixel_mm: float
) -> str:
    """Return the label of a print.

    Parameters
    ----------
    facts
        The origin of the print: job and frame.
    output
        The options of the print.
    page_mm
        Width and height of the array.
    gap
        The words about the distance from the print to the lenses.
    lens_pitch_mm, pixel_mm
        See `print_page`.
    """
    turned = f", turned {output.orientation_deg} deg" if output.orientation_deg else ""
    said = [
        facts,
        f"array {page_mm[0]:.2f} x {page_mm[1]:.2f} mm{', mirrored' if output.mirrored else ''}{turned}",
        gap,
        f"lens pitch {lens_pitch_mm:.6g} mm",
        f"{MM_PER_INCH / pixel_mm:.6g} dpi",
        "print at 100 %",
    ]
    return "  |  ".join(said)
