"""Makers of still pictures of every frame."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import OutputError
from lippmann.job.animation.frames import parse_frames
from lippmann.job.fields.problems import FieldError
from lippmann.job.outputs.pictures import ContactSheet, Epi, PictureOptions, Quilt, Sheets, ViewGrid
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.epi import epi_of_col, epi_of_row
from lippmann.lightfield.views.interpolate import spread, spread_views, views_in_row
from lippmann.lightfield.views.mosaic import cut_to_aspect, mosaic
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, view, view_numbers, views_grid
from lippmann.plan import artifact_names as names
from worker.images.density import Density
from worker.images.drawing import lettering, line_px
from worker.images.resize import resize
from worker.images.write import write_png, write_tiff
from worker.tasks.frames.assemble import on_device
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.registry import describes, makes

Picture = NDArray[np.floating[Any]]


class _Write(Protocol):
    def __call__(self, path: Path, frame: int) -> None: ...


@makes(ViewGrid)
def make_view_grid(context: OutputContext, output: ViewGrid) -> None:
    """Make the picture of all views side by side."""

    def write(path: Path, frame: int) -> None:
        source = context.source
        write_png(path, views_grid(source.image(frame).pixels, source.layout), bits=output.bits)

    _store_every_frame(context, output.suffix, write)


@makes(Sheets)
def make_sheets(context: OutputContext, output: Sheets) -> None:
    """Convert masters to pictures for people."""
    write_picture = write_png if output.file_format == "png" else write_tiff

    def write(path: Path, frame: int) -> None:
        picture = _master(context.source, frame, output.of)
        write_picture(path, picture, bits=output.bits, density=_density(context.source, frame, output.of))

    _store_every_frame(context, output.suffix, write)


@makes(Quilt)
def make_quilt(context: OutputContext, output: Quilt) -> None:
    """Make quilts, whose names carry their layout."""
    layout = context.source.layout
    rows_of_views, across, columns = _quilt_tiles(output, layout)
    count = len(rows_of_views) * across

    def tiles(frame: int) -> Iterator[Picture]:
        image = context.source.image(frame)
        for v in rows_of_views:
            for seen in spread_views(image, v, across):
                yield scaled(seen if output.aspect is None else cut_to_aspect(seen, output.aspect), output)

    def write(path: Path, frame: int) -> None:
        write_png(path, mosaic(tiles(frame), count=count, columns=columns, upward=True), bits=output.bits)

    said = f"_qs{columns}x{count // columns}a{_quilt_aspect(output, layout):.4g}"
    _store_every_frame(context, said + output.suffix, write)


@describes(Quilt)
def about_quilt(source: FrameSource, output: Quilt) -> dict[str, Any]:
    """Return the view of each tile of a quilt, in the order of the tiles: from the lower left to the right, then up."""
    rows_of_views, across, columns = _quilt_tiles(output, source.layout)
    there = views_in_row(source.layout, rows_of_views[0])
    return {
        "columns": columns,
        "rows": len(rows_of_views) * across // columns,
        "aspect": _quilt_aspect(output, source.layout),
        "tiles_uv": [[u, v] for v in rows_of_views for u in spread(there, across).tolist()],
    }


def _quilt_tiles(output: Quilt, layout: CellLayout) -> tuple[tuple[int, ...], int, int]:
    """Return v of each row of views, from the lowest tiles up, the views of each row, and the columns of tiles."""
    if output.views == "all":
        return tuple(range(layout.cell_rows - 1, -1, -1)), layout.cell_cols, layout.cell_cols
    v = centre(layout)[1] if output.view_row is None else output.view_row
    across = output.count or len(views_in_row(layout, v))
    try:
        return (v,), across, output.tile_columns(across)
    except FieldError as wrong:  # of hexagons, a row may have fewer views than the middle one
        raise OutputError(str(wrong)) from wrong


def _quilt_aspect(output: Quilt, layout: CellLayout) -> float:
    high, wide = layout.square_size()
    return output.aspect or wide / high


@makes(Epi)
def make_epi(context: OutputContext, output: Epi) -> None:
    """Make epipolar slices: horizontal ones below each other in a picture, vertical ones side by side in another."""
    layout, cols = context.source.layout, output.lens_cols
    rows = output.lens_rows or (() if cols else (layout.lens_rows // 2,))

    def write_rows(path: Path, frame: int) -> None:
        image = context.source.image(frame)
        slices = (scaled(epi_of_row(image, row).repeat(output.view_px, axis=0), output) for row in rows)
        write_png(path, mosaic(slices, count=len(rows), columns=1, gap_px=output.gap_px), bits=output.bits)

    def write_cols(path: Path, frame: int) -> None:
        image = context.source.image(frame)
        slices = (scaled(epi_of_col(image, col).repeat(output.view_px, axis=1), output) for col in cols)
        write_png(path, mosaic(slices, count=len(cols), columns=len(cols), gap_px=output.gap_px), bits=output.bits)

    if rows:
        _store_every_frame(context, f"-rows{output.suffix}", write_rows)
    if cols:
        _store_every_frame(context, f"-cols{output.suffix}", write_cols)


def scaled(picture: Picture, output: PictureOptions) -> Picture:
    """Return a picture `(rows, cols, 3)` in the size of an output."""
    if output.scale == 1.0:
        return picture
    rows, cols = (max(1, round(side * output.scale)) for side in picture.shape[:2])
    return resize(picture, rows=rows, cols=cols, filter_name=output.filter)


def _store_every_frame(context: OutputContext, ending: str, write: _Write) -> None:
    frames = context.source.frames
    for frame in context.with_progress(frames, len(frames)):
        context.store_file(names.frame_stem(frame) + ending, partial(write, frame=frame))


def _master(source: FrameSource, frame: int, which: str) -> NDArray[np.float16]:
    if which == "integral":
        return source.integral(frame)
    ortho, layout = source.image(frame).pixels, source.layout
    rig = source.rig(frame)
    if which == "views":
        return views_grid(ortho, layout)
    if which == "device" and rig.device is not None:
        return on_device(ortho, layout, rig.device, pitch_mm=rig.lens_array.pitch_mm)
    return ortho


def _density(source: FrameSource, frame: int, which: str) -> Density | None:
    """Return the density at which an image is as large as its lens array; a grid of views has none."""
    rig, layout = source.rig(frame), source.layout
    if which == "views":
        return None
    if which == "device" and rig.device is not None:
        return Density.of_pixel(width_mm=rig.device.pixel_mm, height_mm=rig.device.pixel_mm)
    return sheet_density(layout, pitch_mm=rig.lens_array.pitch_mm)


def sheet_density(layout: CellLayout, *, pitch_mm: float) -> Density:
    """Return the density at which an image is as large as its lens array."""
    height_mm, width_mm = layout.pixel_mm(pitch_mm)
    return Density.of_pixel(width_mm=width_mm, height_mm=height_mm)


FONT_PX = 12
BACKGROUND, INK = 0.03, 0.8
"""Linear light: a dark grey, and letters that are legible on it."""


@makes(ContactSheet)
def make_contact_sheet(context: OutputContext, output: ContactSheet) -> None:
    """Make small pictures side by side, with captions."""
    source = context.source
    frames = source.frames if output.frames is None else parse_frames(output.frames)
    if output.show == "frames":
        frames = frames[:: output.every]
        pictures, count = _of_frames(source, frames), len(frames)
        columns = output.columns or math.isqrt(count - 1) + 1
    else:
        pictures, count, columns = _of_views(source, frames[0], output)

    def write(path: Path) -> None:
        tiles = (
            _captioned(scaled(picture, output), caption) if output.captions else scaled(picture, output)
            for picture, caption in pictures
        )
        watched = context.with_progress(tiles, count)
        sheet = mosaic(watched, count=count, columns=columns, gap_px=output.gap_px, background=BACKGROUND)
        write_png(path, sheet, bits=output.bits)

    context.store_file(output.file_name, write)


def _of_frames(source: FrameSource, frames: tuple[int, ...]) -> Iterator[tuple[Picture, str]]:
    layout = source.layout
    for frame in frames:
        yield as_square(view(source.image(frame).pixels, layout, *centre(layout)), layout), f"frame {frame}"


def _of_views(source: FrameSource, frame: int, output: ContactSheet) -> tuple[Iterator[tuple[Picture, str]], int, int]:
    """Return pictures with captions, their number, and the number of columns."""
    layout = source.layout
    ortho, there = source.image(frame).pixels, set(view_numbers(layout))
    ways = [range(0, side, output.every) for side in (layout.cell_rows, layout.cell_cols)]
    dark = np.full((layout.lens_rows, layout.lens_cols, 3), BACKGROUND, dtype=ortho.dtype)

    def pictures() -> Iterator[tuple[Picture, str]]:
        for v in ways[0]:
            for u in ways[1]:
                shown = (u, v) in there
                yield as_square(view(ortho, layout, u, v) if shown else dark, layout), f"{u}, {v}" if shown else ""

    return pictures(), len(ways[0]) * len(ways[1]), output.columns or len(ways[1])


def _captioned(picture: Picture, caption: str) -> Picture:
    """Return a picture with its caption below it; a caption that is too long is cut."""
    line = np.full((line_px(FONT_PX), *picture.shape[1:]), BACKGROUND, dtype=picture.dtype)
    ink = lettering(caption, size_px=FONT_PX)[:, : picture.shape[1], np.newaxis]
    line[:, : ink.shape[1]] += (ink * (INK - BACKGROUND)).astype(line.dtype)
    return np.concatenate((picture, line))
