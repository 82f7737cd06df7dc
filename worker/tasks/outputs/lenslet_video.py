"""Maker of lenslet sequences in the formats of MPEG: one file of raw frames with a calibration file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.outputs.datasets import LensletVideo
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.orthoscopic import orthoscopic, orthoscopic_layout
from worker.exports.ray_calibration import calibration_xml, lens_grid
from worker.exports.yuv import write_frame
from worker.images.colour import srgb_codes
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.registry import describes, makes
from worker.video.size import even_sided
from worker.whole_file import new_file, write_bytes

LONGEST_NAME = 60


@dataclass(frozen=True)
class _Sequence:
    """The layout, size and name of the sequence."""

    layout: CellLayout
    """The layout of its frames before their sides are made even."""
    stem: str

    @property
    def rows(self) -> int:
        """The rows of a frame, made even."""
        return self.layout.rows + self.layout.rows % 2

    @property
    def cols(self) -> int:
        """The columns of a frame, made even."""
        return self.layout.cols + self.layout.cols % 2


@makes(LensletVideo)
def make_mpeg_lenslet(context: OutputContext, output: LensletVideo) -> None:
    """Make the sequence and its calibration file."""
    source = context.source
    sequence = _sequence(source, output)
    grid = lens_grid(sequence.layout, rows=sequence.rows, cols=sequence.cols)
    ours = _ours(source, output, sequence)
    context.store_file(f"{sequence.stem}.xml", partial(write_bytes, data=calibration_xml(grid, ours=ours)))
    context.store_file(f"{sequence.stem}.yuv", partial(_write_frames, context=context, output=output))


@describes(LensletVideo)
def about_mpeg_lenslet(source: FrameSource, output: LensletVideo) -> Mapping[str, Any]:
    """Describe a lenslet sequence for the sidecar."""
    sequence = _sequence(source, output)
    return {
        "convention": output.convention,
        "frame_size_px": [sequence.rows, sequence.cols],
        "pixel_format": "yuv420p, 8 bits, no header: frame after frame all of Y, all of Cb, all of Cr",
        "colour": "BT.709 matrix, video range, of sRGB codes; chroma is the mean of 2 x 2 px",
        "repeated_px": {"last_row": sequence.layout.rows % 2, "last_col": sequence.layout.cols % 2},
    }


def sequence_name(source: FrameSource, output: LensletVideo) -> str:
    """Return the name of a sequence: the option, or the title or the scene in letters and digits."""
    if output.sequence:
        return output.sequence
    for fact in ("title", "scene"):
        words = re.findall(r"[A-Za-z0-9]+", source.facts.get(fact, ""))
        if words:
            return "".join(word[0].upper() + word[1:] for word in words)[:LONGEST_NAME]
    return "Lippmann"


def _sequence(source: FrameSource, output: LensletVideo) -> _Sequence:
    layout = source.layout
    if output.convention == "pseudoscopic":
        layout = orthoscopic_layout(layout, inverted=_inverted(source, source.frames[0]))
    rows, cols = layout.rows + layout.rows % 2, layout.cols + layout.cols % 2
    name = sequence_name(source, output)
    return _Sequence(layout, f"{name}_{cols}x{rows}_{source.fps:g}fps_8bit")


def _inverted(source: FrameSource, frame: int) -> bool:
    return source.rig(frame).imaging_lens is not None


def _write_frames(path: Path, *, context: OutputContext, output: LensletVideo) -> None:
    source = context.source
    with new_file(path) as file:
        for frame in context.with_progress(source.frames, len(source.frames)):
            sheet = source.image(frame).pixels
            write_frame(file, even_sided(srgb_codes(_turned(sheet, source, frame, output))))


def _turned(sheet: NDArray[np.float16], source: FrameSource, frame: int, output: LensletVideo) -> NDArray[np.float16]:
    """Return the image in the convention of the output: the orthoscopic conversion is its own inverse."""
    if output.convention == "orthoscopic":
        return sheet
    return orthoscopic(sheet, source.layout, inverted=_inverted(source, frame))


def _ours(source: FrameSource, output: LensletVideo, sequence: _Sequence) -> dict[str, object]:
    layout, array = sequence.layout, source.rig(source.frames[0]).lens_array
    return {
        "convention": output.convention,
        "width_px": sequence.cols,
        "height_px": sequence.rows,
        "frames": len(source.frames),
        "fps": f"{source.fps:g}",
        "lattice": layout.lattice,
        "lens_rows": layout.lens_rows,
        "lens_cols": layout.lens_cols,
        "first_row_shifted": str(layout.first_row_shifted).lower(),
        "pitch_px": layout.px_per_lens,
        "row_pitch_px": layout.row_px,
        "pitch_mm": array.pitch_mm,
        "gap_mm": array.focal_length_mm,
    }
