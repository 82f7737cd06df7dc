"""Refocused pictures of an orthoscopic image, written as PNG."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput
from lippmann.lightfield.refocus.shift_and_sum import checked_shifts
from lippmann.local.files.picture_size import PictureSize, check_side
from lippmann.local.files.writable import check_writable
from lippmann.local.image import IntegralImage, RefocusMethod
from lippmann.local.pictures.view import check_png
from worker.images.write import write_png

Light = NDArray[np.floating[Any]]

DEPTHS_AT_ONCE = 16
"""The depths that are refocused together, so that memory does not grow with the stack."""


@dataclass(frozen=True)
class RefocusOptions:
    """The method of refocusing, and the size of the pictures."""

    method: RefocusMethod = "shift_and_sum"
    px_per_lens: int | None = None
    """The pixels a lens by CIIR; None for as many as the image has."""
    size: PictureSize = field(default_factory=PictureSize)

    def __post_init__(self) -> None:
        """Refuse options that contradict each other.

        Raises
        ------
        BadInput
            If pixels a lens are given for shift-and-sum, which has one.
        """
        if self.px_per_lens is not None and self.method != "ciir":
            raise BadInput(f"expected --px-per-lens with --method ciir, got it with {self.method}")

    def check(self, image: IntegralImage, depths_mm: Sequence[float]) -> None:
        """Refuse depths and sizes that cannot be, before any work starts.

        Parameters
        ----------
        image
            An orthoscopic image.
        depths_mm
            The depths, mm in front of the display.

        Raises
        ------
        LayoutError
            If neighbouring views do not overlap at a depth.
        BadInput
            If the pictures would be too large.
        """
        for depth_mm in depths_mm:
            checked_shifts(image.layout, depth_mm, focal_mm=image.focal_length_mm)
        px = 1 if self.method == "shift_and_sum" else self.px_per_lens or image.layout.px_per_lens
        rows, cols = image.layout.square_size(px)
        check_side(max(rows, cols))
        self.size.of(rows, cols)


def write_refocused(image: IntegralImage, out: Path, *, depth_mm: float, options: RefocusOptions) -> None:
    """Write the picture that is refocused to one depth.

    Parameters
    ----------
    image
        An orthoscopic image.
    out
        A PNG.
    depth_mm
        The depth, mm in front of the display.
    options
        The method and the size.

    Raises
    ------
    BadInput, LayoutError
        If the depth or the size cannot be, or the file cannot be written.
    """
    check_png(out)
    options.check(image, (depth_mm,))
    picture = image.refocus(depth_mm, method=options.method, px_per_lens=options.px_per_lens)
    write_png(out, options.size.sized(picture))


def write_all_in_focus(image: IntegralImage, out: Path, *, depths_mm: Sequence[float], size: PictureSize) -> None:
    """Write one picture that is sharp at several depths.

    Parameters
    ----------
    image, out
        As in `write_refocused`.
    depths_mm
        The depths, mm in front of the display.
    size
        The size of the picture.
    """
    check_png(out)
    RefocusOptions(size=size).check(image, depths_mm)
    write_png(out, size.sized(image.all_in_focus(depths_mm)))


def write_focal_stack(
    image: IntegralImage, out: Path, *, depths_mm: Sequence[float], options: RefocusOptions
) -> tuple[Path, ...]:
    """Write a folder of pictures, each refocused to one depth, and return their paths.

    Parameters
    ----------
    image, options
        As in `write_refocused`.
    out
        The folder.
    depths_mm
        The depths, mm in front of the display.
    """
    options.check(image, depths_mm)
    check_writable(out)
    files = tuple(out / f"{depth_mm:+08.2f}mm.png" for depth_mm in depths_mm)
    for path, picture in zip(files, _pictures(image, depths_mm, options), strict=True):
        write_png(path, options.size.sized(picture))
    return files


def _pictures(image: IntegralImage, depths_mm: Sequence[float], options: RefocusOptions) -> Iterator[Light]:
    for start in range(0, len(depths_mm), DEPTHS_AT_ONCE):
        some = depths_mm[start : start + DEPTHS_AT_ONCE]
        yield from image.focal_stack(some, method=options.method, px_per_lens=options.px_per_lens)
