"""Maker of the depth of a view."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lippmann.job.outputs.depth import DepthPictures
from lippmann.lightfield.depth.view_depth import ViewDepth, estimated_depth, true_depth
from lippmann.lightfield.views.views import centre
from lippmann.plan import artifact_names as names
from worker.exports.netpbm import write_pfm
from worker.images.colour import deepest_shown_mm, depth_colours
from worker.images.write import write_channels, write_png
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.registry import describes, makes


@makes(DepthPictures)
def make_depth(context: OutputContext, output: DepthPictures) -> None:
    """Make the depth map of a view of every frame."""
    source = context.source
    for frame in context.with_progress(source.frames, len(source.frames)):
        context.store_file(
            f"{names.frame_stem(frame)}{output.suffix}",
            partial(_write, source=source, output=output, frame=frame),
        )


@describes(DepthPictures)
def about_depth(source: FrameSource, output: DepthPictures) -> Mapping[str, Any]:
    """Describe the view, the colours and the numbers for the sidecar."""
    u, v = _number(source, output)
    if output.range_mm is None:
        end = "the 99th percentile of abs(s) of each frame"
    else:
        end = f"{max(map(abs, output.range_mm)):g} mm"
    return {
        "view": {"u": u, "v": v},
        "s_mm": "depth on a display whose array stands one focal length before its pixels, positive in front",
        "disparity": "s / (n f), pixels of a view (lens pitches) from one view to the next, positive in front",
        "colours": f"grey in the plane of the display, orange to red in front, blue behind, to {end}; black: unknown",
        "rows": "from the bottom up" if output.file_format == "pfm" else "from the top down",
    }


def write_view_depth(path: Path, found: ViewDepth, *, range_mm: tuple[float, float] | None) -> None:
    """Write the depth map of a view in the format of the file's suffix: `.exr`, `.pfm` or `.png`.

    An EXR has three channels, a PFM the disparity, and a PNG colours. The colours end at the deeper end of `range_mm`,
    or without it at the depths themselves.

    Raises
    ------
    OutputError, DiskFull, DiskUnavailable
        If it cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix == ".exr":
        values = np.stack((found.s_mm, found.disparity, found.other), axis=-1).astype(np.float32)
        write_channels(path, (values,), found.channels, size=values.shape[:2], attributes={})
    elif suffix == ".pfm":
        write_pfm(path, found.disparity)
    else:
        deepest_mm = max(map(abs, range_mm)) if range_mm else deepest_shown_mm(found.s_mm)
        write_png(path, depth_colours(found.s_mm, deepest_mm=deepest_mm))


def _number(source: FrameSource, output: DepthPictures) -> tuple[int, int]:
    return centre(source.layout) if output.u is None or output.v is None else (output.u, output.v)


def _write(path: Path, *, source: FrameSource, output: DepthPictures, frame: int) -> None:
    number = _number(source, output)
    if output.source == "truth":
        focal_mm = source.rig(frame).lens_array.focal_length_mm
        found = true_depth(source.depth(frame), source.layout, number, focal_mm=focal_mm)
    else:
        found = estimated_depth(
            source.image(frame), number, method=output.method, range_mm=output.range_mm, reach=output.reach
        )
    write_view_depth(path, found, range_mm=output.range_mm)
