"""Makers of still pictures of every frame."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from worker.images.write import write_png
from worker.integral.views import views_grid
from worker.job.outputs.pictures import ViewGrid
from worker.plan import names
from worker.tasks.outputs.footage import Footage
from worker.tasks.outputs.making import Making


def make_view_grid(making: Making, output: ViewGrid) -> None:
    """Make the picture of all views side by side."""
    frames = making.footage.frames
    for frame in making.told(frames, len(frames)):
        making.keep(
            f"{names.frame_stem(frame)}{output.suffix}",
            partial(_write_grid, footage=making.footage, frame=frame, bits=output.bits),
        )


def _write_grid(path: Path, *, footage: Footage, frame: int, bits: int) -> None:
    write_png(path, views_grid(footage.orthoscopic(frame), footage.layout), bits=bits)
