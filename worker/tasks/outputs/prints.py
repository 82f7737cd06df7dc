"""Maker of prints: the orthoscopic sheet on a printer's pixels, with marks, a page a frame.

A print is read, made and written in bands of rows, so a print of any size takes some 100 MB of memory. Turned, the
printer's pixels pass through a file in the scratch folder.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.outputs.prints import Print
from lippmann.lightfield.sheet.device import device_bands
from lippmann.plan import artifact_names as names
from lippmann.plan.printing.page import PrintPage, label_of, print_page
from worker.exports.pdf import Page, Picture, write_pdf
from worker.images.colour import srgb_codes
from worker.images.density import Density
from worker.images.icc import srgb_profile
from worker.images.png import deflated_rows
from worker.images.turned import turned_bands
from worker.images.write import write_code_rows
from worker.tasks.outputs.footage import Footage
from worker.tasks.outputs.making import Making
from worker.tasks.outputs.paper import paper_bands
from worker.tasks.outputs.registry import describes, makes
from worker.whole_file import new_file


@makes(Print)
def make_print(making: Making, output: Print) -> None:
    """Make a page of every frame."""
    frames = making.footage.frames
    for number, frame in enumerate(making.told(frames, len(frames))):
        part = making.part(number, len(frames))
        making.keep(names.frame_stem(frame) + output.suffix, partial(_write, making=part, output=output, frame=frame))


@describes(Print)
def about_print(footage: Footage, output: Print) -> dict[str, Any]:
    """Return where on the page the array is."""
    page, label = _page(footage, output, footage.frames[0])
    return {
        "page_px": [page.rows, page.cols],
        "array_px": [page.array_rows, page.array_cols],
        "margin_px": page.margin_px,
        "pixel_mm": page.pixel_mm,
        "lens_pitch_mm": output.real_pitch_mm(footage.rig(footage.frames[0])),
        "label": label,
    }


def _write(path: Path, *, making: Making, output: Print, frame: int) -> None:
    footage = making.footage
    page, label = _page(footage, output, frame)
    codes = _array_bands(making, output, frame, page)
    if output.file_format == "pdf":
        with new_file(path) as file:
            write_pdf(file, [_pdf_page(page)], title=label, picture=_pdf_picture(page, codes, output.bits))
        return
    bands = _page_bands(page, codes, output.bits)
    density = Density.of_pixel(width_mm=page.pixel_mm, height_mm=page.pixel_mm)
    write_code_rows(path, bands, size=(page.rows, page.cols), bits=output.bits, density=density)


def _page(footage: Footage, output: Print, frame: int) -> tuple[PrintPage, str]:
    """Return the page of a frame, and what it says of itself."""
    rig, layout = footage.rig(frame), footage.layout
    pixel_mm, lens_pitch_mm = output.pixel_mm(rig), output.real_pitch_mm(rig)
    high, wide = layout.lenses_of_pitch(lens_pitch_mm).extent
    source = " ".join(footage.facts[fact] for fact in ("scene", "job") if footage.facts.get(fact))
    sizes = {"lens_pitch_mm": lens_pitch_mm, "pixel_mm": pixel_mm}
    label = label_of(f"{source} frame {frame}", output, (wide, high), **sizes)
    return print_page(layout, output, label=label, **sizes), label


def _array_bands(making: Making, output: Print, frame: int, page: PrintPage) -> Iterator[NDArray[Any]]:
    """Yield the array's pixels as they lie on the page, sRGB codes, band by band from the top."""
    rig, bits = making.footage.rig(frame), output.bits
    per_lens = output.real_pitch_mm(rig) / output.pixel_mm(rig)
    quarters = output.orientation_deg // 90
    rows, cols = (page.array_cols, page.array_rows) if quarters % 2 else (page.array_rows, page.array_cols)
    step = -1 if output.mirrored else 1
    with making.footage.orthoscopic_rows(frame) as sheet:
        light = making.told_rows(device_bands(sheet, px_per_lens_device=per_lens), rows)
        upright = (srgb_codes(np.ascontiguousarray(band[:, ::step]), bits=bits) for band in light)
        yield from turned_bands(upright, rows=rows, cols=cols, quarters=quarters, bits=bits, folder=making.scratch)


def _page_bands(page: PrintPage, codes: Iterator[NDArray[Any]], bits: int) -> Iterator[NDArray[Any]]:
    """Yield the page, paper and marks around the array."""
    around = partial(paper_bands, page.shapes, pixel_mm=page.pixel_mm, cols=page.cols, bits=bits)
    top = page.margin_px
    yield from around(first=0, stop=top)
    for band in codes:
        rows = np.concatenate(list(around(first=top, stop=top + len(band))))
        rows[:, page.margin_px : page.margin_px + page.array_cols] = band
        yield rows
        top += len(band)
    yield from around(first=top, stop=page.rows)


def _pdf_page(page: PrintPage) -> Page:
    return Page(page.cols * page.pixel_mm, page.rows * page.pixel_mm, page.shapes)


def _pdf_picture(page: PrintPage, codes: Iterator[NDArray[Any]], bits: int) -> Picture:
    rows, cols, k = page.array_rows, page.array_cols, page.pixel_mm
    return Picture(
        left_mm=page.margin_px * k,
        top_mm=page.margin_px * k,
        width_mm=cols * k,
        height_mm=rows * k,
        rows=rows,
        cols=cols,
        bits=bits,
        profile=srgb_profile(),
        deflated=deflated_rows(codes, rows=rows, cols=cols, bits=bits),
    )
