"""Prints: pictures whose size on paper is what they are for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from lippmann.job.outputs.output import Name, OutputOptions, output_kind
from lippmann.job.problems import Misfit
from lippmann.job.rig import MAX_FRAME_PX, MM_PER_INCH, Rig

PrintFormat = Literal["pdf", "tiff", "png"]

MARKS_MM = 7.5
"""From the array to the outer ends of crop and registration marks."""

LABEL_MM = 4.0
"""What the line of text takes outside of these."""

LONGEST_PDF_MM = 14_400 / 72 * MM_PER_INCH
"""The longest side that a page of a PDF may have (ISO 32000-1, annex C): 5080 mm."""


PAGE_MM = 45.0
"""What a calibration sheet is longer and wider than its strips, at most."""


class PaperOptions(OutputOptions):
    """What all outputs for paper have: the device's pixels, and the pitch of the array that will lie on them."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        ".pdf": {},
        ".tif": {"file_format": "tiff"},
        ".png": {"file_format": "png"},
    }

    file_format: PrintFormat = "pdf"
    dpi: float | None = Field(default=None, gt=0, le=100_000)
    pitch_um: float | None = Field(default=None, gt=0, le=100_000)
    """Of the device's pixels, either this or `dpi`; else those of `rig.device`."""
    lens_pitch_mm: float | None = Field(default=None, gt=0, le=1000)
    """Of the real array, as a calibration sheet has found it; else that of the rig."""

    @property
    def suffix(self) -> str:
        """PDF, TIFF or PNG."""
        return {"pdf": ".pdf", "tiff": ".tif", "png": ".png"}[self.file_format]

    @model_validator(mode="after")
    def _pixels_said_once(self) -> Self:
        if self.dpi is not None and self.pitch_um is not None:
            raise Misfit("dpi", expected="either this or pitch_um", got="both")
        return self

    def pixel_mm(self, rig: Rig) -> float:
        """Return the pitch of the device's pixels.

        Raises
        ------
        Misfit
            If neither the output nor the rig says it.
        """
        if self.dpi is not None:
            return MM_PER_INCH / self.dpi
        if self.pitch_um is not None:
            return self.pitch_um / 1000
        if rig.device is not None:
            return rig.device.pixel_mm
        raise Misfit("dpi", expected="this or pitch_um, as there is no rig.device", got="neither")

    def real_pitch_mm(self, rig: Rig) -> float:
        """Return the pitch of the array that lies on the paper."""
        return self.lens_pitch_mm or rig.lens_array.pitch_mm

    def check_page(self, side_mm: float, pixel_mm: float, *, field: str) -> None:
        """Refuse a page that no file of this format has, by the field that makes it so long."""
        px = math.ceil(side_mm / pixel_mm)
        if px > MAX_FRAME_PX:
            got = f"{px} px, {side_mm:.0f} mm of pixels of {pixel_mm * 1000:.4g} um"
            raise Misfit(field, expected=f"a page of at most {MAX_FRAME_PX} px a side", got=got)
        if self.file_format == "pdf" and side_mm > LONGEST_PDF_MM:
            expected = f"tiff or png for a page of more than {LONGEST_PDF_MM:.0f} mm a side"
            raise Misfit("file_format", expected=expected, got=f"pdf of {side_mm:.0f} mm")


@output_kind
class Print(PaperOptions):
    """The orthoscopic sheet on the pixels of a printer, one page a frame, for the array to be laid on."""

    kind: Literal["print"] = "print"
    name: Name = "print"
    bits: Literal[8, 16] = 8
    margin_mm: float = Field(default=12.0, ge=0, le=1000)
    """White paper around the array, rounded up to whole pixels."""
    crop_marks: bool = True
    """Where the array's edges are, at its corners."""
    registration_marks: bool = True
    """A ring and a cross at the lens edges nearest to the middle of each side."""
    label: bool = True
    """A line of text: job, frame, pitch, dpi, and that it is to be printed at 100 %."""
    mirrored: bool = False
    """Left and right exchanged: for the back of a transparent array."""
    orientation_deg: Literal[0, 90, 180, 270] = 0
    """By which the array lies turned on the page, clockwise, after it was mirrored."""

    @property
    def needed_margin_mm(self) -> float:
        """What marks and label take."""
        return MARKS_MM * (self.crop_marks or self.registration_marks) + LABEL_MM * self.label

    @model_validator(mode="after")
    def _marks_have_room(self) -> Self:
        if self.margin_mm < self.needed_margin_mm:
            expected = f"at least {self.needed_margin_mm:g} mm for the marks and the label, or fewer of these"
            raise Misfit("margin_mm", expected=expected, got=f"{self.margin_mm:g}")
        return self

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a print of unknown pixels, and one that is too large."""
        pixel_mm = self.pixel_mm(rig)
        side_mm = max(rig.layout.lenses_of_pitch(self.real_pitch_mm(rig)).extent)
        self.check_page(side_mm, pixel_mm, field="dpi" if self.pitch_um is None else "pitch_um")
        self.check_page(side_mm + 2 * self.margin_mm, pixel_mm, field="margin_mm")


@output_kind
class CalibrationSheet(PaperOptions):
    """Strips of lines of slightly different pitches: the one that is even under the array has its pitch."""

    kind: Literal["calibration_sheet"] = "calibration_sheet"
    name: Name = "calibration_sheet"
    range_percent: float = Field(default=1.0, gt=0, le=20)
    """How far strips go from the pitch that is expected, to both sides."""
    steps: int = Field(default=21, ge=3, le=201)
    """Strips; an odd number has one of the pitch itself."""
    length_mm: float = Field(default=150.0, gt=0, le=1000)
    """Of a strip: the longer, the finer."""
    strip_mm: float = Field(default=7.0, ge=1, le=100)
    """Width of a strip."""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a sheet of unknown pixels, of pixels too coarse for its lines, and one that is too large."""
        pixel_mm, pitch_mm = self.pixel_mm(rig), self.real_pitch_mm(rig)
        closest_mm = pitch_mm / rig.layout.cell.row_period * (1 - self.range_percent / 100)
        if closest_mm < 4 * pixel_mm:
            expected = f"pixels of at most {closest_mm * 250:.4g} um, a quarter of what lines are apart"
            field = "dpi" if self.pitch_um is None else "pitch_um"
            raise Misfit(field, expected=expected, got=f"{pixel_mm * 1000:.4g} um")
        if self.length_mm < 10 * pitch_mm:
            raise Misfit("length_mm", expected=f"at least ten lenses, {10 * pitch_mm:g} mm", got=f"{self.length_mm:g}")
        self.check_page(self.length_mm + PAGE_MM, pixel_mm, field="length_mm")
        self.check_page(self.steps * (self.strip_mm + 1) + PAGE_MM, pixel_mm, field="steps")
