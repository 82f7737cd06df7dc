"""The mounting sheet of a print: what goes where, in millimetres.

It has the place of the lenses on the page of the print, and the layers from the print to the lenses.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from lippmann.job.optics.rig import Rig
from lippmann.job.optics.viewing import GapUse
from lippmann.job.outputs.prints import PAPERS_MM, Print
from lippmann.plan.printing.page import PrintPage
from lippmann.plan.printing.shapes import Bar, Shape, TextLine, line

LEFT_MM, RIGHT_MM = 18.0, 192.0
"""The sides of what is on the sheet; both A4 and Letter have them."""
LINE_MM = 0.25
TITLE_MM, TEXT_MM, SMALL_MM = 5.0, 3.2, 2.6
"""The sizes of letters."""
STEP_MM = 5.2
"""The distance of lines of text."""

DRAWING_TOP_MM = 40.0
DRAWING_MM = 62.0
"""The largest side of the drawing of the page."""

_USES = {
    "real": "for images in front of the display",
    "virtual": "for images behind the display",
    "collimated": "one focal length, as the depths of the scene are unknown",
}
_CONTACT_MM = 0.005
"""The least difference of the gap and the substrate that counts: below it, the substrate touches the print."""
_FIELDS = {"real": "display.gap_real_mm", "virtual": "display.gap_virtual_mm"}
"""The field of a job that sets the gap, by its use."""


@dataclass(frozen=True)
class Mounting:
    """The gap of a display, as built."""

    gap_mm: float
    """The distance from the print to the lenses, with the substrate."""
    use: GapUse
    """The images that the gap suits."""
    substrate_mm: float
    """The thickness of the substrate of the array."""
    viewing_distance_mm: float

    @property
    def is_too_thin(self) -> bool:
        """True if the substrate alone is thicker than the gap, which cannot be built with the array as it is."""
        return self.substrate_mm - self.gap_mm >= _CONTACT_MM

    @property
    def gap_words(self) -> str:
        """The gap for the label of the print."""
        warning = f", thinner than the substrate of {self.substrate_mm:.2f} mm" if self.is_too_thin else ""
        return f"gap {self.gap_mm:.2f} mm{warning}"

    @property
    def spacer_mm(self) -> float:
        """The air between the print and the substrate, or 0 if they touch."""
        air_mm = self.gap_mm - self.substrate_mm
        return air_mm if air_mm >= _CONTACT_MM else 0.0


def mounting_sheet(
    page: PrintPage, output: Print, rig: Rig, mounting: Mounting, *, facts: str
) -> tuple[tuple[float, float], tuple[Shape, ...]]:
    """Lay out the mounting sheet of a print.

    Parameters
    ----------
    page, output, rig
        The page of the print, its options, and the rig.
    mounting
        The gap.
    facts
        The origin of the print: job and frame.

    Returns
    -------
    tuple
        The (width, height) of the sheet, mm, and the shapes on it: A4, or the paper of the print.
    """
    shapes: list[Shape] = [
        TextLine(LEFT_MM, 20.0, TITLE_MM, "Mounting sheet"),
        TextLine(LEFT_MM, 27.0, SMALL_MM, facts),
        TextLine(LEFT_MM, DRAWING_TOP_MM - 6.0, TEXT_MM, "The print, as its label is read"),
        *_drawn_page(page),
    ]
    top_mm = DRAWING_TOP_MM
    for text in _places(page, output, rig):
        shapes.append(TextLine(LEFT_MM + DRAWING_MM + 14.0, top_mm + TEXT_MM, TEXT_MM, text))
        top_mm += STEP_MM
    layers_mm = DRAWING_TOP_MM + DRAWING_MM + 22.0
    shapes += _drawn_layers(mounting, layers_mm)
    top_mm = layers_mm + 52.0
    for text in _steps(output, rig, mounting):
        shapes.append(TextLine(LEFT_MM, top_mm, TEXT_MM, text))
        top_mm += STEP_MM
    return PAPERS_MM["a4" if output.page == "array" else output.page], tuple(shapes)


def _places(page: PrintPage, output: Print, rig: Rig) -> Iterator[str]:
    """Yield the sizes and distances on the page of the print."""
    lenses, array = page.lenses, rig.lens_array
    rows, cols = array.count[::-1] if output.orientation_deg in (90, 270) else array.count
    yield f"Page: {page.width_mm:.1f} mm wide, {page.height_mm:.1f} mm high"
    yield f"Array: {lenses.width_mm:.2f} mm wide, {lenses.height_mm:.2f} mm high"
    yield f"{cols} x {rows} lenses ({array.lattice}), pitch {output.real_pitch_mm(rig):.6g} mm"
    yield "The array begins"
    yield f"    {lenses.left_mm:.2f} mm from the left edge of the page,"
    yield f"    {lenses.top_mm:.2f} mm from its upper edge."
    yield f"It ends {page.width_mm - lenses.right_mm:.2f} mm from the right edge,"
    yield f"    {page.height_mm - lenses.bottom_mm:.2f} mm from the lower edge."
    if output.crop_marks:
        yield "The crop marks are in line with these edges of the array."


def _drawn_page(page: PrintPage) -> Iterator[Shape]:
    """Yield a small drawing of the page, with the array and its distances from the edges."""
    scale = DRAWING_MM / max(page.width_mm, page.height_mm)
    left, top = LEFT_MM + 6.0, DRAWING_TOP_MM
    sheet = Bar(left, top, page.width_mm * scale, page.height_mm * scale)
    lenses = page.lenses
    array = Bar(
        left + lenses.left_mm * scale, top + lenses.top_mm * scale, lenses.width_mm * scale, lenses.height_mm * scale
    )
    yield from _outline(sheet)
    yield from _outline(array)
    x_mm, y_mm = array.left_mm + array.width_mm / 2, array.top_mm + array.height_mm / 2
    yield line(sheet.left_mm, y_mm, array.left_mm, y_mm, line_mm=LINE_MM)
    yield line(x_mm, sheet.top_mm, x_mm, array.top_mm, line_mm=LINE_MM)
    yield TextLine(left, sheet.bottom_mm + 4.0, SMALL_MM, f"left {lenses.left_mm:.2f} mm, top {lenses.top_mm:.2f} mm")
    yield TextLine(x_mm, y_mm + SMALL_MM / 3, SMALL_MM, "array", centred=True)


def _drawn_layers(mounting: Mounting, top_mm: float) -> Iterator[Shape]:
    """Yield a drawing of the layers from the print to the eye, seen from the side and not to scale."""
    yield TextLine(
        LEFT_MM, top_mm, TEXT_MM, "From the side, not to scale: the print on the left, the observer on the right"
    )
    top_mm += 8.0
    substrate = f"{mounting.substrate_mm:.2f} mm"
    if mounting.is_too_thin:
        substrate = f"{mounting.gap_mm:.2f} mm of {substrate}"
    layers = [("print", "", 6.0), ("lens array", substrate, 34.0)]
    if mounting.spacer_mm:
        layers.insert(1, ("air: spacers", f"{mounting.spacer_mm:.2f} mm", 34.0))
    left_mm = LEFT_MM + 6.0
    for name, thickness, wide_mm in layers:
        box = Bar(left_mm, top_mm, wide_mm, 20.0)
        yield from _outline(box)
        middle_mm = box.left_mm + wide_mm / 2
        yield TextLine(middle_mm, box.bottom_mm + 4.0, SMALL_MM, name, centred=True)
        yield TextLine(middle_mm, box.top_mm + 11.0, SMALL_MM, thickness, centred=True)
        left_mm += wide_mm
    start_mm = LEFT_MM + 12.0
    yield line(start_mm, top_mm + 28.0, left_mm, top_mm + 28.0, line_mm=LINE_MM)
    for x_mm in (start_mm, left_mm):
        yield line(x_mm, top_mm + 26.5, x_mm, top_mm + 29.5, line_mm=LINE_MM)
    gap = f"gap {mounting.gap_mm:.2f} mm, {_USES[mounting.use]}"
    yield TextLine(start_mm, top_mm + 33.0, TEXT_MM, gap)
    yield TextLine(left_mm + 4.0, top_mm + 11.0, SMALL_MM, f"observer at {mounting.viewing_distance_mm:.0f} mm")


def _remedies(mounting: Mounting) -> Iterator[str]:
    """Yield what can be done about a gap that is thinner than the substrate."""
    gap, substrate = f"{mounting.gap_mm:.2f} mm", f"{mounting.substrate_mm:.2f} mm"
    yield f"The gap of {gap} is thinner than the substrate of {substrate}: this array cannot be mounted so."
    yield f"Grind the substrate down to {gap}, or use an array with a substrate of at most {gap}."
    field = _FIELDS.get(mounting.use)
    other = f"or set {field} of the job to {substrate} or more, and print again" if field else "and see less sharply"
    yield f"Otherwise lay the substrate directly on the print, {other}."


def _outline(box: Bar) -> Iterator[Bar]:
    for y_mm in (box.top_mm, box.bottom_mm):
        yield line(box.left_mm, y_mm, box.right_mm, y_mm, line_mm=LINE_MM)
    for x_mm in (box.left_mm, box.right_mm):
        yield line(x_mm, box.top_mm, x_mm, box.bottom_mm, line_mm=LINE_MM)


def _steps(output: Print, rig: Rig, mounting: Mounting) -> Iterator[str]:
    """Yield what to do, in its order."""
    steps = ["Print at 100 %, and measure the array with a ruler: its size is above."]
    if mounting.is_too_thin:
        steps += _remedies(mounting)
    elif mounting.spacer_mm:
        steps.append(f"Lay spacers of {mounting.spacer_mm:.2f} mm on the print, under the edges of the array.")
    elif mounting.substrate_mm:
        steps.append("Lay the substrate of the array directly on the print, without air.")
    if output.mirrored:
        steps.append(
            "The print is mirrored: it is for the back of a transparent array or film, and is seen through it."
        )
    edges = "the crop marks" if output.crop_marks else "the edges of the picture"
    steps.append(f"Lay the array on top with its lenses toward the observer, its edges in line with {edges}.")
    if output.label and not output.orientation_deg:
        steps.append("The label is below the picture.")
    elif output.orientation_deg:
        steps.append(f"The picture is turned clockwise by {output.orientation_deg} degrees on the page.")
    distance_mm = mounting.viewing_distance_mm
    steps.append(f"Look from {distance_mm:.0f} mm with one eye, and move the array until the picture is in the middle.")
    if rig.lens_array.substrate_mm == 0:
        steps.append(
            "The job names no substrate (rig.lens_array.substrate_mm): all of the gap is air up to the lenses."
        )
    for number, text in enumerate(steps, start=1):
        yield f"{number}. {text}"
