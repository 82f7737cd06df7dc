"""What is told beside an output, as JSON: how its pixels lie, by which conventions, and what made it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

from worker.job.outputs.output import OutputOptions
from worker.tasks.outputs.footage import Footage

MADE_WITH = ("lippmann", "numpy", "openimageio", "av")


def sidecar(footage: Footage, output: OutputOptions, files: Sequence[str]) -> bytes:
    """Return the sidecar of an output.

    Parameters
    ----------
    footage
        What it was made of; numbers that are keyframed are those of the first frame.
    output
        What was asked for.
    files
        Names below the job.
    """
    said = {
        "output": output.model_dump(mode="json"),
        "files": list(files),
        "source": {name: text for name, text in footage.facts.items() if text},
        "frames": list(footage.frames),
        "fps": footage.fps,
        "integral_image": _geometry(footage),
        "made_with": {name: version(name) for name in MADE_WITH},
    }
    return json.dumps(said, indent=2).encode() + b"\n"


def _geometry(footage: Footage) -> dict[str, Any]:
    layout, rig = footage.layout, footage.rig(footage.frames[0])
    array = rig.lens_array
    return {
        "convention": "orthoscopic",
        "orientation": "upright: row 0 is the top and col 0 the left, as the observer sees the display",
        "views": "u grows as the eye moves to the right, v as it moves down; (0, 0) is the view from the upper left",
        "lattice": layout.lattice,
        "lens_rows": layout.lens_rows,
        "lens_cols": layout.lens_cols,
        "pitch_px": layout.px_per_lens,
        "row_pitch_px": layout.row_px,
        "offset_px": [layout.overhang_px + layout.row_px / 2, layout.shift_px(0) + layout.px_per_lens / 2],
        "pitch_mm": array.pitch_mm,
        "focal_length_mm": array.focal_length_mm,
        "gap_mm": array.focal_length_mm,
        "projection": rig.camera.projection,
    }
