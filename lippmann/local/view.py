"""Views of an orthoscopic master, as PNG."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput, LayoutError
from lippmann.lightfield.refocus.depth_focused_view import depth_view
from lippmann.lightfield.views.perspective import Eye, perspective
from lippmann.lightfield.views.square_pixels import as_square, square_size
from lippmann.lightfield.views.views import centre, view
from lippmann.local.files.master import read_orthoscopic
from lippmann.local.files.writable import check_writable
from lippmann.local.numbers import numbers_of
from lippmann.local.picture_size import PictureSize, check_side
from worker.images.write import write_png


@dataclass(frozen=True)
class Seen:
    """What an eye saw."""

    file: Path
    rows: int
    cols: int
    dark_lenses: int
    """Lenses that showed it no light of their own cell."""


def view_here(file: Path, out: Path, *, number: tuple[int, int] | None, size: PictureSize) -> Seen:
    """Write a view, or without a number the one in the middle.

    Raises
    ------
    BadInput
        If there is no such view, or as in `read_orthoscopic`.
    """
    check_png(out)
    master = read_orthoscopic(file)
    try:
        picture = view(master.sheet, master.layout, *(number or centre(master.layout)))
    except LayoutError as error:
        raise BadInput(error.message) from error
    return _seen(out, as_square(picture, master.layout), size)


def depth_view_here(
    file: Path,
    out: Path,
    *,
    number: tuple[int, int] | None,
    depth_mm: float,
    px_per_lens: int | None,
    size: PictureSize,
) -> Seen:
    """Write the view that joins up at a depth, about a view or, without a number, about the lenses' axes.

    Raises
    ------
    BadInput
        If there is no such view, or none at that depth, or as in `read_orthoscopic`.
    """
    check_png(out)
    master = read_orthoscopic(file)
    check_side(max(square_size(master.layout, px_per_lens or 1)))
    try:
        picture = depth_view(
            master.sheet,
            master.layout,
            depth_mm,
            focal_mm=master.focal_mm,
            direction=number,
            px_per_lens=px_per_lens,
        )
    except LayoutError as error:
        raise BadInput(error.message) from error
    return _seen(out, picture, size)


def eye_here(file: Path, out: Path, *, place_mm: str, size: PictureSize) -> Seen:
    """Write what an eye at "X,Y,Z" sees, mm: to the right, upward, in front.

    Raises
    ------
    BadInput
        If the eye is not in front of the display, or as in `read_orthoscopic`.
    """
    check_png(out)
    eye = eye_at(place_mm)
    master = read_orthoscopic(file)
    found = perspective(master.sheet, master.layout, eye, pitch_mm=master.pitch_mm, gap_mm=master.focal_mm)
    return _seen(out, as_square(found.picture, master.layout), size, dark_lenses=int((~found.seen).sum()))


def eye_at(place_mm: str) -> Eye:
    """Return the eye at "X,Y,Z", mm: to the right, upward, in front.

    Raises
    ------
    BadInput
        If it is not in front of the display.
    """
    right_mm, up_mm, distance_mm = numbers_of(place_mm, ",", count=3, wanted="an eye as X,Y,Z in mm")
    try:
        return Eye(x_mm=right_mm, y_mm=up_mm, distance_mm=distance_mm)
    except LayoutError as error:
        raise BadInput(error.message) from error


def check_png(out: Path) -> None:
    """Refuse what is no PNG in a folder that can be written to.

    Raises
    ------
    BadInput
        Naming it.
    """
    if out.suffix.lower() != ".png":
        raise BadInput(f"expected a .png in --out, got {out}")
    check_writable(out.parent)


def _seen(out: Path, picture: NDArray[np.floating[Any]], size: PictureSize, *, dark_lenses: int = 0) -> Seen:
    shown = size.sized(picture)
    write_png(out, shown)
    return Seen(file=out, rows=shown.shape[0], cols=shown.shape[1], dark_lenses=dark_lenses)
