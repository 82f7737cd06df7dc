"""Views of an orthoscopic image, written as PNG."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput
from lippmann.local.files.picture_size import PictureSize, check_side
from lippmann.local.files.writable import check_writable
from lippmann.local.image import IntegralImage, Place
from worker.images.write import write_png


@dataclass(frozen=True)
class WrittenView:
    """The file of a view, and its size in pixels."""

    file: Path
    rows: int
    cols: int
    dark_lenses: int
    """The number of lenses that show the eye no light of their own cell."""


def write_view(image: IntegralImage, out: Path, *, number: tuple[int, int] | None, size: PictureSize) -> WrittenView:
    """Write a view.

    Parameters
    ----------
    image
        An orthoscopic image.
    out
        A PNG.
    number
        (u, v) of the view; None for the one nearest to the axes of the lenses.
    size
        The size of the picture.

    Raises
    ------
    BadInput
        If the file cannot be written, or is no PNG.
    LayoutError
        If there is no such view.
    """
    check_png(out)
    return _write(out, image.view(*(number or image.centre)), size)


def write_depth_focused_view(
    image: IntegralImage,
    out: Path,
    *,
    number: tuple[int, int] | None,
    depth_mm: float,
    px_per_lens: int | None,
    size: PictureSize,
) -> WrittenView:
    """Write the view that joins up at a depth.

    Parameters
    ----------
    image, out, size
        As in `write_view`.
    number
        (u, v) of the view; None for the axes of the lenses.
    depth_mm
        The depth, mm in front of the display.
    px_per_lens
        The pixels a lens of the picture before it is resized; None for as many as the depth gives.

    Raises
    ------
    BadInput, LayoutError
        As in `write_view`, or if there is no such view at that depth.
    """
    check_png(out)
    check_side(max(image.layout.square_size(px_per_lens or 1)))
    return _write(out, image.depth_focused_view(depth_mm, direction=number, px_per_lens=px_per_lens), size)


def write_perspective(image: IntegralImage, out: Path, *, eye: Place, size: PictureSize) -> WrittenView:
    """Write what an eye sees through pinholes in place of the lenses.

    Parameters
    ----------
    image, out, size
        As in `write_view`.
    eye
        (x, y, z) of the eye, mm to the right, upward and in front of the middle of the display.

    Raises
    ------
    BadInput, LayoutError
        As in `write_view`, or if the eye is not in front of the display.
    """
    check_png(out)
    dark_lenses = int((~image.lenses_seen(eye)).sum())
    return _write(out, image.perspective(eye), size, dark_lenses=dark_lenses)


def check_png(out: Path) -> None:
    """Refuse a file that is no PNG, or whose folder cannot be written.

    Raises
    ------
    BadInput
        If so, naming the file.
    """
    if out.suffix.lower() != ".png":
        raise BadInput(f"expected a .png in --out, got {out}")
    check_writable(out.parent)


def _write(out: Path, picture: NDArray[np.floating[Any]], size: PictureSize, *, dark_lenses: int = 0) -> WrittenView:
    resized = size.sized(picture)
    write_png(out, resized)
    return WrittenView(file=out, rows=resized.shape[0], cols=resized.shape[1], dark_lenses=dark_lenses)
