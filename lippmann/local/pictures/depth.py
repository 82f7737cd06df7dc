"""The depth map of a view, known or estimated, written to a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from lippmann.errors import BadInput
from lippmann.lightfield.depth.errors import DepthErrors, depth_errors
from lippmann.lightfield.depth.view_depth import Method, ViewDepth
from lippmann.local.files.writable import check_writable
from lippmann.local.image import IntegralImage
from worker.tasks.outputs.depth import write_view_depth

SUFFIXES = (".png", ".exr", ".pfm")


@dataclass(frozen=True)
class WrittenDepth:
    """The file of a depth map, and the depth in it."""

    file: Path
    number: tuple[int, int]
    depth: ViewDepth
    errors: DepthErrors | None
    """The errors of an estimate, if the true depth is known."""


def write_depth(
    image: IntegralImage,
    out: Path,
    *,
    truth: bool,
    number: tuple[int, int] | None,
    method: Method,
    reach: int,
    range_mm: tuple[float, float] | None,
    border_px: int,
) -> WrittenDepth:
    """Write the depth map of a view.

    Parameters
    ----------
    image
        An orthoscopic image, opened with its depth if that is stored.
    out
        A PNG of false colours, an EXR of three channels, or a PFM of the disparity.
    truth
        True for the known depth, False for the estimate.
    number
        (u, v) of the view; None for the one nearest to the axes of the lenses.
    method, reach, range_mm
        As in `IntegralImage.depth`; the colours reach as far as `range_mm`.
    border_px
        The pixels along each edge whose error does not count.

    Raises
    ------
    BadInput
        If it is another kind of file or cannot be written, or the true depth is asked for and not known.
    LayoutError
        If there is no such view.
    """
    if out.suffix.lower() not in SUFFIXES:
        raise BadInput(f"expected {', '.join(SUFFIXES)} in --out, got {out}")
    check_writable(out.parent)
    u, v = number or image.centre
    known = image.true_depth(u, v) if image.depth_map is not None else None
    if truth:
        if known is None:
            raise BadInput("expected the depth of a job with capture.depth beside the master, got no file")
        found, errors = known, None
    else:
        found = image.depth(u, v, method=method, range_mm=range_mm, reach=reach)
        errors = depth_errors(found.disparity, known.disparity, border_px=border_px) if known else None
    write_view_depth(out, found, range_mm=range_mm)
    return WrittenDepth(file=out, number=(u, v), depth=found, errors=errors)
