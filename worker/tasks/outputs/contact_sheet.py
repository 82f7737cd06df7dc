"""Maker of contact sheets: one picture for the whole job."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from lippmann.job.frames import parse_frames
from lippmann.job.outputs.pictures import ContactSheet
from lippmann.lightfield.views.mosaic import mosaic
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, view, view_numbers
from worker.images.lettering import lettering, line_px
from worker.images.write import write_png
from worker.tasks.outputs.footage import Footage
from worker.tasks.outputs.making import Making
from worker.tasks.outputs.pictures import Picture, scaled
from worker.tasks.outputs.registry import makes

FONT_PX = 12
BACKGROUND, INK = 0.03, 0.8
"""Linear light: dark grey, and letters that are read on it."""


@makes(ContactSheet)
def make_contact_sheet(making: Making, output: ContactSheet) -> None:
    """Make small pictures side by side, with captions."""
    footage = making.footage
    frames = footage.frames if output.frames is None else parse_frames(output.frames)
    if output.show == "frames":
        frames = frames[:: output.every]
        pictures, count = _of_frames(footage, frames), len(frames)
        columns = output.columns or math.isqrt(count - 1) + 1
    else:
        pictures, count, columns = _of_views(footage, frames[0], output)

    def write(path: Path) -> None:
        tiles = (
            _captioned(scaled(picture, output), caption) if output.captions else scaled(picture, output)
            for picture, caption in pictures
        )
        watched = making.told(tiles, count)
        sheet = mosaic(watched, count=count, columns=columns, gap_px=output.gap_px, background=BACKGROUND)
        write_png(path, sheet, bits=output.bits)

    making.keep(output.file_name, write)


def _of_frames(footage: Footage, frames: tuple[int, ...]) -> Iterator[tuple[Picture, str]]:
    layout = footage.layout
    for frame in frames:
        yield as_square(view(footage.image(frame).pixels, layout, *centre(layout)), layout), f"frame {frame}"


def _of_views(footage: Footage, frame: int, output: ContactSheet) -> tuple[Iterator[tuple[Picture, str]], int, int]:
    """Return pictures with captions, how many there are, and how many stand side by side."""
    layout = footage.layout
    ortho, there = footage.image(frame).pixels, set(view_numbers(layout))
    ways = [range(0, side, output.every) for side in (layout.cell_rows, layout.cell_cols)]
    dark = np.full((layout.lens_rows, layout.lens_cols, 3), BACKGROUND, dtype=ortho.dtype)

    def pictures() -> Iterator[tuple[Picture, str]]:
        for v in ways[0]:
            for u in ways[1]:
                shown = (u, v) in there
                yield as_square(view(ortho, layout, u, v) if shown else dark, layout), f"{u}, {v}" if shown else ""

    return pictures(), len(ways[0]) * len(ways[1]), output.columns or len(ways[1])


def _captioned(picture: Picture, caption: str) -> Picture:
    """Return a picture with a line below it; a caption that is too long is cut."""
    line = np.full((line_px(FONT_PX), *picture.shape[1:]), BACKGROUND, dtype=picture.dtype)
    ink = lettering(caption, size_px=FONT_PX)[:, : picture.shape[1], np.newaxis]
    line[:, : ink.shape[1]] += (ink * (INK - BACKGROUND)).astype(line.dtype)
    return np.concatenate((picture, line))
