"""The depth of a view of a master: known, or estimated and compared with what is known."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from lippmann.errors import BadInput, LayoutError
from lippmann.lightfield.depth.depth_map import CHANNELS, DepthMap
from lippmann.lightfield.depth.errors import DepthErrors, depth_errors
from lippmann.lightfield.depth.view_depth import Method, ViewDepth, estimated_depth, true_depth
from lippmann.lightfield.views.views import centre
from lippmann.local.files.master import Orthoscopic, read_orthoscopic
from lippmann.local.files.writable import check_writable
from worker.images.read import read_channels
from worker.tasks.outputs.depth import write_view_depth

SUFFIXES = (".png", ".exr", ".pfm")


@dataclass(frozen=True)
class FoundDepth:
    """What was written."""

    file: Path
    number: tuple[int, int]
    depth: ViewDepth
    errors: DepthErrors | None
    """Of an estimate where the truth is there."""


def depth_here(
    file: Path,
    out: Path,
    *,
    truth: bool,
    number: tuple[int, int] | None,
    method: Method,
    reach: int,
    range_mm: tuple[float, float] | None,
    border_px: int,
) -> FoundDepth:
    """Write the depth of a view, or without a number of the one in the middle.

    Raises
    ------
    BadInput
        If there is no such view, or no truth where it is asked for; or as in `read_orthoscopic`.
    """
    if out.suffix.lower() not in SUFFIXES:
        raise BadInput(f"expected {', '.join(SUFFIXES)} in --out, got {out}")
    if range_mm is not None and not range_mm[0] < range_mm[1]:
        raise BadInput(f"expected depths as FARTHEST:NEAREST in mm, rising, got {range_mm[0]:g}:{range_mm[1]:g}")
    check_writable(out.parent)
    master = read_orthoscopic(file)
    number = number or centre(master.layout)
    try:
        known = _known(file, master, number)
        if truth:
            if known is None:
                raise BadInput(f"expected the depth of a job with capture.depth at {_beside(file)}, got no file")
            found, errors = known, None
        else:
            layout, focal_mm = master.layout, master.focal_mm
            found = estimated_depth(
                master.sheet, layout, number, focal_mm=focal_mm, method=method, range_mm=range_mm, reach=reach
            )
            errors = depth_errors(found.disparity, known.disparity, border_px=border_px) if known else None
    except LayoutError as error:
        raise BadInput(error.message) from error
    write_view_depth(out, found, range_mm=range_mm)
    return FoundDepth(file=out, number=number, depth=found, errors=errors)


def _beside(file: Path) -> Path:
    """Return where the depth of an orthoscopic master lies, as fetch and capture leave it."""
    return file.absolute().parent.parent / "depth" / file.name


def _known(file: Path, master: Orthoscopic, number: tuple[int, int]) -> ViewDepth | None:
    path = _beside(file)
    if not path.is_file():
        return None
    depth = DepthMap(read_channels(path, CHANNELS))
    return true_depth(depth, master.layout, number, focal_mm=master.focal_mm)
