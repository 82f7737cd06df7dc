"""Makers of prints and calibration sheets: pages at the pixels of a printer, with marks.

A print is read, made and written in bands of rows, so a print of any size takes some 100 MB of memory. Turned, the
printer's pixels pass through a file in the scratch folder.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.optics.rig import Rig
from lippmann.job.outputs.prints import CalibrationSheet, Print
from lippmann.lightfield.sheet.device import device_bands
from lippmann.plan import artifact_names as names
from lippmann.plan.design.observed_display import gap_in_use
from lippmann.plan.printing.calibration_sheet import DIRECTIONS, CalibrationPage, Strip, calibration_page, moire_mm
from lippmann.plan.printing.mounting import Mounting, mounting_sheet
from lippmann.plan.printing.page import PrintPage, label_of, print_page
from lippmann.plan.printing.shapes import Shape
from worker.exports.pdf import Page, Picture, write_pdf
from worker.images.bands.png import deflated_rows
from worker.images.bands.rearrange import turned_bands
from worker.images.colour import srgb_codes
from worker.images.density import Density
from worker.images.drawing import paper
from worker.images.icc import srgb_profile
from worker.images.write import write_code_rows
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.registry import describes, makes
from worker.whole_file import new_file

MOUNTING = "mounting.pdf"
"""The mounting sheet of a print, in the folder of the output."""


@makes(Print)
def make_print(context: OutputContext, output: Print) -> None:
    """Make a page of every frame, and a mounting sheet."""
    frames = context.source.frames
    for number, frame in enumerate(context.with_progress(frames, len(frames))):
        part = context.part(number, len(frames))
        context.store_file(
            names.frame_stem(frame) + output.suffix, partial(_write, context=part, output=output, frame=frame)
        )
    if output.mounting_sheet:
        context.store_file(MOUNTING, partial(_write_mounting_sheet, source=context.source, output=output))


@describes(Print)
def about_print(source: FrameSource, output: Print) -> dict[str, Any]:
    """Describe the place of the array on the page for the sidecar."""
    page, label = _page(source, output, source.frames[0])
    mounting = _mounting(source, source.frames[0])
    return {
        "page_px": [page.rows, page.cols],
        "page_mm": [page.height_mm, page.width_mm],
        "array_px": [page.array_rows, page.array_cols],
        "array_top_px": page.top_px,
        "array_left_px": page.left_px,
        "gap_mm": mounting.gap_mm,
        "gap_use": mounting.use,
        "gap_is_thinner_than_substrate": mounting.is_too_thin,
        "pixel_mm": page.pixel_mm,
        "lens_pitch_mm": output.real_pitch_mm(source.rig(source.frames[0])),
        "label": label,
    }


def _write(path: Path, *, context: OutputContext, output: Print, frame: int) -> None:
    source = context.source
    page, label = _page(source, output, frame)
    codes = _array_bands(context, output, frame, page)
    if output.file_format == "pdf":
        with new_file(path) as file:
            write_pdf(file, [_pdf_page(page)], title=label, picture=_pdf_picture(page, codes, output.bits))
        return
    bands = _page_bands(page, codes, output.bits)
    density = Density.of_pixel(width_mm=page.pixel_mm, height_mm=page.pixel_mm)
    write_code_rows(path, bands, size=(page.rows, page.cols), bits=output.bits, density=density)


def _page(source: FrameSource, output: Print, frame: int) -> tuple[PrintPage, str]:
    """Return the page of a frame, with its label."""
    rig, layout = source.rig(frame), source.layout
    pixel_mm, lens_pitch_mm = output.pixel_mm(rig), output.real_pitch_mm(rig)
    high, wide = layout.lenses_of_pitch(lens_pitch_mm).extent
    sizes = {"lens_pitch_mm": lens_pitch_mm, "pixel_mm": pixel_mm}
    gap = _mounting(source, frame).gap_words
    label = label_of(_origin(source, frame), output, (wide, high), gap=gap, **sizes)
    return print_page(layout, output, label=label, **sizes), label


def _origin(source: FrameSource, frame: int) -> str:
    origin = " ".join(source.facts[fact] for fact in ("scene", "job") if source.facts.get(fact))
    return f"{origin} frame {frame}"


def _mounting(source: FrameSource, frame: int) -> Mounting:
    """Return how the print of a frame is mounted."""
    rig = source.rig(frame)
    use, gap = gap_in_use(rig, source.display, stage=source.stage(frame))
    return Mounting(gap.physical_mm, use, rig.lens_array.substrate_mm, source.display.viewing_distance_mm)


def _write_mounting_sheet(path: Path, *, source: FrameSource, output: Print) -> None:
    """Write the mounting sheet of the first frame."""
    first, rig = source.frames[0], source.rig(source.frames[0])
    page, _ = _page(source, output, first)
    others = "; the label of every other frame has its own gap" if len(source.frames) > 1 else ""
    facts = _origin(source, first) + others
    (width_mm, height_mm), shapes = mounting_sheet(page, output, rig, _mounting(source, first), facts=facts)
    with new_file(path) as file:
        write_pdf(file, [Page(width_mm, height_mm, shapes)], title=f"Mounting sheet: {facts}")


def _array_bands(context: OutputContext, output: Print, frame: int, page: PrintPage) -> Iterator[NDArray[Any]]:
    """Yield the pixels of the array on the page in bands from the top, as sRGB codes."""
    rig, bits = context.source.rig(frame), output.bits
    per_lens = output.real_pitch_mm(rig) / output.pixel_mm(rig)
    quarters = output.orientation_deg // 90
    rows, cols = (page.array_cols, page.array_rows) if quarters % 2 else (page.array_rows, page.array_cols)
    step = -1 if output.mirrored else 1
    with context.source.orthoscopic_rows(frame) as sheet:
        light = context.rows_with_progress(device_bands(sheet, px_per_lens_device=per_lens), rows)
        upright = (srgb_codes(np.ascontiguousarray(band[:, ::step]), bits=bits) for band in light)
        yield from turned_bands(upright, rows=rows, cols=cols, quarters=quarters, bits=bits, folder=context.scratch)


def _page_bands(page: PrintPage, codes: Iterator[NDArray[Any]], bits: int) -> Iterator[NDArray[Any]]:
    """Yield the page in bands: the array with paper and marks around it."""
    around = partial(paper_bands, page.shapes, pixel_mm=page.pixel_mm, cols=page.cols, bits=bits)
    top = page.top_px
    yield from around(first=0, stop=top)
    for band in codes:
        rows = np.concatenate(list(around(first=top, stop=top + len(band))))
        rows[:, page.left_px : page.left_px + page.array_cols] = band
        yield rows
        top += len(band)
    yield from around(first=top, stop=page.rows)


def _pdf_page(page: PrintPage) -> Page:
    return Page(page.width_mm, page.height_mm, page.shapes)


def _pdf_picture(page: PrintPage, codes: Iterator[NDArray[Any]], bits: int) -> Picture:
    rows, cols, k = page.array_rows, page.array_cols, page.pixel_mm
    return Picture(
        left_mm=page.left_px * k,
        top_mm=page.top_px * k,
        width_mm=cols * k,
        height_mm=rows * k,
        rows=rows,
        cols=cols,
        bits=bits,
        profile=srgb_profile(),
        deflated=deflated_rows(codes, rows=rows, cols=cols, bits=bits),
    )


BAND_ROWS = 64
"""The rows of paper that are drawn together."""


def paper_bands(
    shapes: Iterable[Shape], *, pixel_mm: float, first: int, stop: int, cols: int, bits: int
) -> Iterator[NDArray[Any]]:
    """Yield the codes of the rows [first, stop) of a page of shapes, `(some rows, cols, 3)`, sRGB."""
    for top in range(first, stop, BAND_ROWS):
        light = paper(shapes, pixel_mm=pixel_mm, top=top, rows=min(BAND_ROWS, stop - top), cols=cols)
        yield srgb_codes(light.astype(np.float16)[:, :, np.newaxis], bits=bits).repeat(3, axis=2)


TITLE = "Calibration sheet"


@makes(CalibrationSheet)
def make_calibration_sheet(context: OutputContext, output: CalibrationSheet) -> None:
    """Make the sheet: a PDF of two pages, or a picture for each direction."""
    rig = context.source.rig(context.source.frames[0])
    for file, pages in sheet_files(output, rig):
        context.store_file(file, partial(write_sheet, output=output, pages=pages))


@describes(CalibrationSheet)
def about_calibration_sheet(source: FrameSource, output: CalibrationSheet) -> dict[str, Any]:
    """Describe the strips for the sidecar: pitch, place, and the width of the bands at the nominal pitch."""
    rig = source.rig(source.frames[0])
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
    OutputError, DiskFull, DiskUnavailable
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
