"""Refocused pictures of an orthoscopic master, as PNG."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput, LayoutError
from lippmann.lightfield.refocus.all_in_focus import extended_focus
from lippmann.lightfield.refocus.ciir import ciir_stack
from lippmann.lightfield.refocus.shift_and_sum import checked_shifts, focal_stack
from lippmann.lightfield.views.square_pixels import square_size
from lippmann.local.files.master import Orthoscopic, read_orthoscopic
from lippmann.local.files.writable import check_writable
from lippmann.local.numbers import numbers_of
from lippmann.local.picture_size import PictureSize, check_side
from lippmann.local.view import check_png
from worker.images.write import write_png

Light = NDArray[np.floating[Any]]

MAX_DEPTHS = 1000
"""Of a stack: beyond it a step was mistyped."""

DEPTHS_AT_ONCE = 16
"""Of a folder of depths, so that memory does not grow with it."""


@dataclass(frozen=True)
class Focusing:
    """How pictures are focused anew."""

    method: Literal["shift_and_sum", "ciir"] = "shift_and_sum"
    px_per_lens: int | None = None
    """Of CIIR; as many as the sheet's when not said."""
    size: PictureSize = field(default_factory=PictureSize)

    def __post_init__(self) -> None:
        """Refuse what does not go together.

        Raises
        ------
        BadInput
            If pixels a lens are asked of shift-and-sum, which has one.
        """
        if self.px_per_lens is not None and self.method != "ciir":
            raise BadInput(f"expected --px-per-lens with --method ciir, got it with {self.method}")

    def stack(self, master: Orthoscopic, depths_mm: Sequence[float]) -> Light:
        """Return the pictures at some depths, `(depth, row, col, 3)`, before they are brought to a size."""
        focal_mm = master.focal_mm
        if self.method == "shift_and_sum":
            return focal_stack(master.sheet, master.layout, depths_mm, focal_mm=focal_mm)
        return ciir_stack(master.sheet, master.layout, depths_mm, focal_mm=focal_mm, px_per_lens=self.px_per_lens)

    def check(self, master: Orthoscopic, depths_mm: Sequence[float]) -> None:
        """Refuse what cannot be, before work starts.

        Raises
        ------
        LayoutError
            If a depth is too far off.
        BadInput
            If the pictures would be too large.
        """
        for depth_mm in depths_mm:
            checked_shifts(master.layout, depth_mm, focal_mm=master.focal_mm)
        px = 1 if self.method == "shift_and_sum" else self.px_per_lens or master.layout.px_per_lens
        rows, cols = square_size(master.layout, px)
        check_side(max(rows, cols))
        self.size.of(rows, cols)


def refocus_here(file: Path, out: Path, *, depths_mm: Sequence[float], focusing: Focusing) -> None:
    """Write one picture: sharp at a depth, or of several depths at all of them (extended focus).

    Parameters
    ----------
    file
        The orthoscopic master.
    out
        A PNG.
    depths_mm
        s of the display, positive in front of it.
    focusing
        By which method, and in which size.

    Raises
    ------
    BadInput
        If a depth is too far off, or as in `read_orthoscopic`.
    """
    check_png(out)
    master = _checked(file, depths_mm, focusing)
    stack = focusing.stack(master, depths_mm)
    write_png(out, focusing.size.sized(extended_focus(stack).picture))


def stack_here(file: Path, out: Path, *, depths_mm: Sequence[float], focusing: Focusing) -> tuple[Path, ...]:
    """Write a folder of pictures, each sharp at one depth, and return their paths; see `refocus_here`."""
    master = _checked(file, depths_mm, focusing)
    check_writable(out)
    files = tuple(out / f"{depth_mm:+08.2f}mm.png" for depth_mm in depths_mm)
    for path, picture in zip(files, _pictures(master, depths_mm, focusing), strict=True):
        write_png(path, focusing.size.sized(picture))
    return files


def _pictures(master: Orthoscopic, depths_mm: Sequence[float], focusing: Focusing) -> Iterator[Light]:
    for start in range(0, len(depths_mm), DEPTHS_AT_ONCE):
        yield from focusing.stack(master, depths_mm[start : start + DEPTHS_AT_ONCE])


def _checked(file: Path, depths_mm: Sequence[float], focusing: Focusing) -> Orthoscopic:
    master = read_orthoscopic(file)
    try:
        focusing.check(master, depths_mm)
    except LayoutError as error:
        raise BadInput(error.message) from error
    return master


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
