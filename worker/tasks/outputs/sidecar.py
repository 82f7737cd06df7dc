"""The sidecar of an output: a JSON file with its geometry, its conventions, and the versions that made it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

from lippmann.job.optics.rig import Rig
from lippmann.job.outputs.output import OutputOptions
from lippmann.lattice.layout import CellLayout
from worker.tasks.outputs.frame_source import FrameSource

MADE_WITH = ("lippmann", "numpy", "openimageio", "av")


def sidecar(
    source: FrameSource, output: OutputOptions, files: Sequence[str], about: Mapping[str, Any] | None = None
) -> bytes:
    """Return the sidecar of an output.

    Parameters
    ----------
    source
        The frames; keyframed numbers are those of the first frame.
    output
        The options of the output.
    files
        The names of its files below the job.
    about
        The description of the files by their kind of output.
    """
    said = {
        "output": output.model_dump(mode="json"),
        "files": list(files),
        "source": {name: text for name, text in source.facts.items() if text},
        "frames": list(source.frames),
        "fps": source.fps,
        **({"format": dict(about)} if about else {}),
        "integral_image": geometry(source, source.frames[0]),
        "display": source.display.model_dump(mode="json"),
        "made_with": {name: version(name) for name in MADE_WITH},
    }
    return json.dumps(said, indent=2).encode() + b"\n"


def geometry(source: FrameSource, frame: int) -> dict[str, Any]:
    """Return the geometry and the conventions of the orthoscopic integral image of a frame."""
    return geometry_of(source.layout, source.rig(frame))


def geometry_of(layout: CellLayout, rig: Rig) -> dict[str, Any]:
    """Return the geometry and the conventions of an orthoscopic integral image of a rig."""
    array = rig.lens_array
    return {
        "convention": "orthoscopic",
        "orientation": "upright: row 0 is the top and col 0 the left, as the observer sees the display",
        "views": "u grows as the eye moves to the right, v as it moves down; (0, 0) is the view from the upper left",
        "depth": "s in mm from the array, positive in front, of a display whose array stands gap_mm before its pixels;"
        " a point moves s / (gap_mm x pitch_px) lenses from a view to the next, against the eye",
        "lattice": layout.lattice,
        "lens_rows": layout.lens_rows,
        "lens_cols": layout.lens_cols,
        "pitch_px": layout.px_per_lens,
        "row_pitch_px": layout.row_px,
        "offset_px": [layout.overhang_px + layout.row_px / 2, layout.shift_px(0) + layout.px_per_lens / 2],
        "shifted_rows": _shifted_rows(layout),
        "rotation_deg": 0.0,
        "size_px": [layout.rows, layout.cols],
        "pitch_mm": array.pitch_mm,
        "focal_length_mm": array.focal_length_mm,
        "gap_mm": array.focal_length_mm,
        "projection": rig.camera.projection,
    }


def _shifted_rows(layout: CellLayout) -> str | None:
    """Return which lens rows are shifted right by half a pitch, counted from 0 at the top."""
    if not layout.staggered:  # the rows of a square array and a single hexagonal row have no shift to describe
        return None
    return "even" if layout.first_row_shifted else "odd"
