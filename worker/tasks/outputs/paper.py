"""Pages as pictures: paper with black shapes, and what a file of them says of its size."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worker.images.colour import srgb_codes
from worker.images.density import Density
from worker.images.drawing import paper
from worker.images.png import write_png_bands
from worker.images.tiff import write_tiff_bands
from worker.job.outputs.prints import PrintFormat
from worker.plan.shapes import Shape
from worker.whole_file import new_file

BAND_ROWS = 64
"""Of paper, that are drawn together."""


def write_page(
    path: Path,
    bands: Iterable[NDArray[Any]],
    *,
    file_format: PrintFormat,
    rows: int,
    cols: int,
    bits: int,
    pixel_mm: float,
) -> None:
    """Write a page's codes as TIFF or PNG with the density of its pixels; see `write_tiff_bands`.

    Raises
    ------
    OutputError, StoreFull, StoreUnavailable
        If it cannot be written, and then no part of it is left.
    """
    write = {"tiff": write_tiff_bands, "png": write_png_bands}[file_format]
    density = Density.of_pixel(width_mm=pixel_mm, height_mm=pixel_mm)
    with new_file(path) as file:
        write(file, bands, rows=rows, cols=cols, bits=bits, density=density)


def paper_bands(
    shapes: Iterable[Shape], *, pixel_mm: float, first: int, stop: int, cols: int, bits: int
) -> Iterator[NDArray[Any]]:
    """Yield the codes of the rows [first, stop) of a page of shapes, `(some rows, cols, 3)`, sRGB."""
    for top in range(first, stop, BAND_ROWS):
        light = paper(shapes, pixel_mm=pixel_mm, top=top, rows=min(BAND_ROWS, stop - top), cols=cols)
        yield srgb_codes(light.astype(np.float16)[:, :, np.newaxis], bits=bits).repeat(3, axis=2)
