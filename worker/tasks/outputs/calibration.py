"""Maker of calibration sheets: a page across and a page down, without a frame."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from lippmann.job.outputs.prints import CalibrationSheet
from lippmann.job.rig import Rig
from lippmann.plan.printing.calibration_sheet import DIRECTIONS, CalibrationPage, Strip, calibration_page, moire_mm
from worker.exports.pdf import Page, write_pdf
from worker.images.density import Density
from worker.images.write import write_code_rows
from worker.tasks.outputs.footage import Footage
from worker.tasks.outputs.making import Making
from worker.tasks.outputs.paper import paper_bands
from worker.tasks.outputs.registry import describes, makes
from worker.whole_file import new_file

TITLE = "Calibration sheet"


@makes(CalibrationSheet)
def make_calibration_sheet(making: Making, output: CalibrationSheet) -> None:
    """Make the sheet: a PDF of two pages, or a picture for each direction."""
    rig = making.footage.rig(making.footage.frames[0])
    for file, pages in sheet_files(output, rig):
        making.keep(file, partial(write_sheet, output=output, pages=pages))


@describes(CalibrationSheet)
def about_calibration_sheet(footage: Footage, output: CalibrationSheet) -> dict[str, Any]:
    """Return which strip has which pitch, where it is, and how wide bands are over it if the pitch is as expected."""
    rig = footage.rig(footage.frames[0])
    pitch_mm = output.real_pitch_mm(rig)

    def strip_of(strip: Strip) -> dict[str, float | None]:
        bands_mm = moire_mm(pitch_mm, strip.pitch_mm)
        return {**vars(strip), "bands_mm": bands_mm if math.isfinite(bands_mm) else None}

    pages = [calibration_page(output, rig, direction) for direction in DIRECTIONS]
    return {
        page.direction: {"page_px": [page.rows, page.cols], "strips": list(map(strip_of, page.strips))}
        for page in pages
    }


def sheet_files(output: CalibrationSheet, rig: Rig) -> Iterator[tuple[str, tuple[CalibrationPage, ...]]]:
    """Yield the name of each file and the pages in it."""
    pages = tuple(calibration_page(output, rig, direction) for direction in DIRECTIONS)
    if output.file_format == "pdf":
        yield output.file_name, pages
        return
    for page in pages:
        yield f"{output.name}-{page.direction}{output.suffix}", (page,)


def write_sheet(path: Path, output: CalibrationSheet, pages: tuple[CalibrationPage, ...]) -> None:
    """Write a file of the sheet.

    Raises
    ------
    OutputError, StoreFull, StoreUnavailable
        If it cannot be written, and then no part of it is left.
    """
    if output.file_format == "pdf":
        drawn = [Page(page.cols * page.pixel_mm, page.rows * page.pixel_mm, page.shapes) for page in pages]
        with new_file(path) as file:
            write_pdf(file, drawn, title=TITLE)
        return
    (page,) = pages
    bands = paper_bands(page.shapes, first=0, stop=page.rows, pixel_mm=page.pixel_mm, cols=page.cols, bits=8)
    density = Density.of_pixel(width_mm=page.pixel_mm, height_mm=page.pixel_mm)
    write_code_rows(path, bands, size=(page.rows, page.cols), density=density)
