"""Views and refocused pictures of an orthoscopic master, as PNG."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput
from lippmann.master_file import read_orthoscopic
from lippmann.numbers import numbers_of
from lippmann.writable import check_writable
from worker.errors import LayoutError
from worker.images.write import write_png
from worker.integral.extended_focus import extended_focus
from worker.integral.perspective import Eye, perspective
from worker.integral.refocus import focal_stack
from worker.integral.square_pixels import as_square
from worker.integral.views import centre, view

MAX_DEPTHS = 1000
"""Of a stack: beyond it a step was mistyped."""


@dataclass(frozen=True)
class Seen:
    """What an eye saw."""

    file: Path
    rows: int
    cols: int
    dark_lenses: int
    """Lenses that showed it no light of their own cell."""


def view_here(file: Path, out: Path, *, number: tuple[int, int] | None) -> Seen:
    """Write a view, or without a number the one in the middle.

    Raises
    ------
    BadInput
        If there is no such view, or as in `read_orthoscopic`.
    """
    _check_png(out)
    master = read_orthoscopic(file)
    try:
        picture = view(master.sheet, master.layout, *(number or centre(master.layout)))
    except LayoutError as error:
        raise BadInput(error.message) from error
    return _seen(out, as_square(picture, master.layout), dark_lenses=0)


def eye_here(file: Path, out: Path, *, place_mm: str) -> Seen:
    """Write what an eye at "X,Y,Z" sees, mm: to the right, upward, in front.

    Raises
    ------
    BadInput
        If the eye is not in front of the display, or as in `read_orthoscopic`.
    """
    _check_png(out)
    eye = eye_at(place_mm)
    master = read_orthoscopic(file)
    found = perspective(master.sheet, master.layout, eye, pitch_mm=master.pitch_mm, gap_mm=master.focal_mm)
    return _seen(out, as_square(found.picture, master.layout), dark_lenses=int((~found.seen).sum()))


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


def refocus_here(file: Path, out: Path, *, depths_mm: Sequence[float]) -> None:
    """Write one picture: sharp at a depth, or of several depths at all of them (extended focus).

    Parameters
    ----------
    file
        The orthoscopic master.
    out
        A PNG.
    depths_mm
        s of the display, positive in front of it.

    Raises
    ------
    BadInput
        If a depth is too far off, or as in `read_orthoscopic`.
    """
    _check_png(out)
    write_png(out, extended_focus(_stack(file, depths_mm)).picture)


def stack_here(file: Path, out: Path, *, depths_mm: Sequence[float]) -> tuple[Path, ...]:
    """Write a folder of pictures, each sharp at one depth, and return their paths; see `refocus_here`."""
    stack = _stack(file, depths_mm)
    check_writable(out)
    files = tuple(out / f"{depth_mm:+08.2f}mm.png" for depth_mm in depths_mm)
    for path, picture in zip(files, stack, strict=True):
        write_png(path, picture)
    return files


def depths_of(stack: str) -> tuple[float, ...]:
    """Return the depths that "A:B:STEP" names, mm, both ends among them where the step meets them.

    Raises
    ------
    BadInput
        If it does not count up, or names more than `MAX_DEPTHS`.

    Examples
    --------
    >>> depths_of("-10:10:5")
    (-10.0, -5.0, 0.0, 5.0, 10.0)
    """
    first, last, step = numbers_of(stack, ":", count=3, wanted="depths as A:B:STEP in mm")
    if last < first or step < 0.01:
        raise BadInput(f"expected depths that count up by 0.01 mm or more, got {stack}")
    count = math.floor((last - first) / step + 1e-9) + 1
    if count > MAX_DEPTHS:
        raise BadInput(f"expected at most {MAX_DEPTHS} depths, got {count} in {stack}")
    return tuple(round(first + index * step, 6) for index in range(count))


def _stack(file: Path, depths_mm: Sequence[float]) -> NDArray[np.floating[Any]]:
    master = read_orthoscopic(file)
    try:
        return focal_stack(master.sheet, master.layout, depths_mm, focal_mm=master.focal_mm)
    except LayoutError as error:
        raise BadInput(error.message) from error


def _check_png(out: Path) -> None:
    if out.suffix.lower() != ".png":
        raise BadInput(f"expected a .png in --out, got {out}")
    check_writable(out.parent)


def _seen(out: Path, picture: NDArray[np.floating[Any]], *, dark_lenses: int) -> Seen:
    write_png(out, picture)
    return Seen(file=out, rows=picture.shape[0], cols=picture.shape[1], dark_lenses=dark_lenses)
