"""Prints: pages with an exact size on paper."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from lippmann.job.fields.problems import FieldError
from lippmann.job.optics.rig import MAX_FRAME_PX, MM_PER_INCH, Rig
from lippmann.job.outputs.output import Name, OutputOptions, output_kind

PrintFormat = Literal["pdf", "tiff", "png"]

PageSize = Literal["array", "a4", "letter"]
"""The size of a page: that of the array with its margin, or that of a sheet of paper."""

PAPERS_MM: Mapping[PageSize, tuple[float, float]] = {"a4": (210.0, 297.0), "letter": (215.9, 279.4)}
"""The width and height of sheets of paper (ISO 216, ANSI/ASME Y14.1)."""

MARKS_MM = 7.5
"""The distance from the array to the outer ends of crop and registration marks."""

LABEL_MM = 4.0
"""The height of the line of text outside the marks."""

LONGEST_PDF_MM = 14_400 / 72 * MM_PER_INCH
"""The longest side that a page of a PDF may have (ISO 32000-1, annex C): 5080 mm."""


PAGE_MM = 45.0
"""The most by which a calibration sheet is longer and wider than its strips."""


class PaperOptions(OutputOptions):
    """The base of outputs for paper: the pixels of the device, and the pitch of the real array."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        ".pdf": {},
        ".tif": {"file_format": "tiff"},
        ".png": {"file_format": "png"},
    }

    file_format: PrintFormat = "pdf"
    """The file format."""
    dpi: float | None = Field(default=None, gt=0, le=100_000)
    """The resolution in pixels per inch, either this or `pitch_um`; the default is that of `rig.device`."""
    pitch_um: float | None = Field(default=None, gt=0, le=100_000)
    """The pitch of the device's pixels, either this or `dpi`; the default is that of `rig.device`."""
    lens_pitch_mm: float | None = Field(default=None, gt=0, le=1000)
    """The pitch of the real array, as measured with a calibration sheet; the default is that of the rig."""

    @property
    def suffix(self) -> str:
        """The suffix of the file format: PDF, TIFF or PNG."""
        return {"pdf": ".pdf", "tiff": ".tif", "png": ".png"}[self.file_format]

    @model_validator(mode="after")
    def _pixels_given_once(self) -> Self:
        if self.dpi is not None and self.pitch_um is not None:
            raise FieldError("dpi", expected="either this or pitch_um", got="both")
        return self

    def pixel_mm(self, rig: Rig) -> float:
        """Return the pitch of the device's pixels.

        Raises
        ------
        FieldError
            If neither the output nor the rig has it.
        """
        if self.dpi is not None:
            return MM_PER_INCH / self.dpi
        if self.pitch_um is not None:
            return self.pitch_um / 1000
        if rig.device is not None:
            return rig.device.pixel_mm
        raise FieldError("dpi", expected="this or pitch_um, as there is no rig.device", got="neither")

    def real_pitch_mm(self, rig: Rig) -> float:
        """Return the pitch of the array on the paper, mm."""
        return self.lens_pitch_mm or rig.lens_array.pitch_mm

    def check_page(self, side_mm: float, pixel_mm: float, *, field: str) -> None:
        """Refuse a page that is too long for the file format; the error names the field that makes it so long."""
        px = math.ceil(side_mm / pixel_mm)
        if px > MAX_FRAME_PX:
            got = f"{px} px, {side_mm:.0f} mm of pixels of {pixel_mm * 1000:.4g} um"
            raise FieldError(field, expected=f"a page of at most {MAX_FRAME_PX} px a side", got=got)
        if self.file_format == "pdf" and side_mm > LONGEST_PDF_MM:
            expected = f"tiff or png for a page of more than {LONGEST_PDF_MM:.0f} mm a side"
            raise FieldError("file_format", expected=expected, got=f"pdf of {side_mm:.0f} mm")


@output_kind
class Print(PaperOptions):
    """The orthoscopic integral image on the pixels of a printer, one page per frame, to be put under the array."""

    kind: Literal["print"] = "print"
    name: Name = "print"
    bits: Literal[8, 16] = 8
    """The bits of each colour channel."""
    margin_mm: float = Field(default=12.0, ge=0, le=1000)
    """White paper around the array, rounded up to whole pixels; the least on a sheet of paper."""
    page: PageSize = "array"
    """The size of the page. On a sheet of paper the array is in the middle; the sheet lies upright if there is room."""
    crop_marks: bool = True
    """Marks at the corners of the array."""
    registration_marks: bool = True
    """A ring and a cross at the lens edges nearest to the middle of each side."""
    label: bool = True
    """A line of text: job, frame, gap, pitch, dpi, and that it is to be printed at 100 %."""
    mounting_sheet: bool = True
    """A page that says in mm what goes where when the print is mounted under the array."""
    mirrored: bool = False
    """True to exchange left and right, for the back of a transparent array."""
    orientation_deg: Literal[0, 90, 180, 270] = 0
    """The clockwise rotation of the array on the page, after it was mirrored."""

    @property
    def needed_margin_mm(self) -> float:
        """The width of the margin that marks and label need."""
        return MARKS_MM * (self.crop_marks or self.registration_marks) + LABEL_MM * self.label

    @model_validator(mode="after")
    def _marks_have_room(self) -> Self:
        if self.margin_mm < self.needed_margin_mm:
            expected = f"at least {self.needed_margin_mm:g} mm for the marks and the label, or fewer of these"
            raise FieldError("margin_mm", expected=expected, got=f"{self.margin_mm:g}")
        return self

    def paper_mm(self, wide_mm: float, high_mm: float) -> tuple[float, float] | None:
        """Return the width and height of the sheet of paper for an array as it lies on the page; None for its own size.

        Raises
        ------
        FieldError
            If the array and its margin are larger than the sheet.
        """
        if self.page == "array":
            return None
        paper = PAPERS_MM[self.page]
        needed = wide_mm + 2 * self.margin_mm, high_mm + 2 * self.margin_mm
        for width_mm, height_mm in (paper, paper[::-1]):
            if needed[0] <= width_mm and needed[1] <= height_mm:
                return width_mm, height_mm
        expected = "array, or fewer or smaller lenses or margins"
        got = (
            f"{self.page} for {needed[0]:.1f} x {needed[1]:.1f} mm, of which {self.margin_mm:g} mm are margin on a side"
        )
        raise FieldError("page", expected=expected, got=got)

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a print of unknown pixels, and one that is too large."""
        pixel_mm = self.pixel_mm(rig)
        high_mm, wide_mm = rig.layout.lenses_of_pitch(self.real_pitch_mm(rig)).extent
        side_mm = max(high_mm, wide_mm)
        self.check_page(side_mm, pixel_mm, field="dpi" if self.pitch_um is None else "pitch_um")
        self.check_page(side_mm + 2 * self.margin_mm, pixel_mm, field="margin_mm")
        paper_mm = self.paper_mm(*((high_mm, wide_mm) if self.orientation_deg in (90, 270) else (wide_mm, high_mm)))
        if paper_mm is not None:
            self.check_page(max(paper_mm), pixel_mm, field="page")


@output_kind
class CalibrationSheet(PaperOptions):
    """Strips of lines of slightly different pitches; the strip that looks even under the array shows the true pitch."""

    kind: Literal["calibration_sheet"] = "calibration_sheet"
    name: Name = "calibration_sheet"
    range_percent: float = Field(default=1.0, gt=0, le=20)
    """The range of the pitches of the strips on both sides of the nominal pitch."""
    steps: int = Field(default=21, ge=3, le=201)
    """The number of strips; an odd number includes the nominal pitch."""
    length_mm: float = Field(default=150.0, gt=0, le=1000)
    """The length of a strip: a longer strip shows a smaller difference of pitch."""
    strip_mm: float = Field(default=7.0, ge=1, le=100)
    """The width of a strip."""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a sheet of unknown pixels, of pixels too coarse for its lines, and one that is too large."""
        pixel_mm, pitch_mm = self.pixel_mm(rig), self.real_pitch_mm(rig)
        closest_mm = pitch_mm / rig.layout.cell.row_period * (1 - self.range_percent / 100)
        if closest_mm < 4 * pixel_mm:
            expected = f"pixels of at most {closest_mm * 250:.4g} um, a quarter of what lines are apart"
            field = "dpi" if self.pitch_um is None else "pitch_um"
            raise FieldError(field, expected=expected, got=f"{pixel_mm * 1000:.4g} um")
        if self.length_mm < 10 * pitch_mm:
            raise FieldError(
                "length_mm", expected=f"at least ten lenses, {10 * pitch_mm:g} mm", got=f"{self.length_mm:g}"
            )
        self.check_page(self.length_mm + PAGE_MM, pixel_mm, field="length_mm")
        self.check_page(self.steps * (self.strip_mm + 1) + PAGE_MM, pixel_mm, field="steps")
