"""Pages as pictures: paper with black shapes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.plan.printing.shapes import Shape
from worker.images.colour import srgb_codes
from worker.images.drawing import paper

BAND_ROWS = 64
"""Of paper, that are drawn together."""


def paper_bands(
    shapes: Iterable[Shape], *, pixel_mm: float, first: int, stop: int, cols: int, bits: int
) -> Iterator[NDArray[Any]]:
    """Yield the codes of the rows [first, stop) of a page of shapes, `(some rows, cols, 3)`, sRGB."""
    for top in range(first, stop, BAND_ROWS):
        light = paper(shapes, pixel_mm=pixel_mm, top=top, rows=min(BAND_ROWS, stop - top), cols=cols)
        yield srgb_codes(light.astype(np.float16)[:, :, np.newaxis], bits=bits).repeat(3, axis=2)
