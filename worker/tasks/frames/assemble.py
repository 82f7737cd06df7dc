"""Tiles -> integral image -> orthoscopic -> views -> thumbnail, in bands of rows: a frame need not fit in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import ArtifactBroken
from lippmann.job.messages.orders import Order, TileIndex
from lippmann.job.optics.rig import Device
from lippmann.job.rendering.channels import (
    CHANNEL_PARTS,
    NOTHING,
    channel_attributes,
    objects_in,
    part_names,
    stored_channels,
)
from lippmann.job.rendering.render_settings import Channel
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.depth.depth_map import CHANNELS, turned_bands
from lippmann.lightfield.sheet.assemble import assembled
from lippmann.lightfield.sheet.bands import OrthoscopicSheet, Rows, Sheet, SheetOfRows, bands, stitched
from lippmann.lightfield.sheet.device import device_bands, device_size, to_device
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, grid_size
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import Tile, cut_tiles, device_pixels, frame_size
from worker.images.bands.rearrange import views_rows
from worker.images.bands.rows import BAND_PX, open_rows
from worker.images.read import read_attributes
from worker.images.write import write_thumbnail
from worker.tasks.attempts.artifacts import TaskArtifacts, naming_artifact
from worker.tasks.attempts.attempt import TaskResult
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames.imported import imported_sheet
from worker.tasks.frames.masters import Masters
from worker.tasks.scenes.scene_camera import assembled_job

THUMB_PX = 256
"""The longer side of a thumbnail."""


def assemble_frame(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
    """Assemble the tiles of a frame into its masters; the thumbnail is stored last, so it means that all exist."""
    assert order.frame is not None  # noqa: S101 - the dispatcher's promise
    sheet, frame = place.job_sheet(order.job_id), order.frame
    thumb, artifacts = names.thumb_name(frame), TaskArtifacts(place.store, order, monitor)
    if artifacts.exists(thumb) and all(artifacts.exists(name) for name in names.masters(sheet.spec, frame)):
        return TaskResult(digests=artifacts.stored)
    sheet = assembled_job(place, order, artifacts)
    rig = sheet.at(frame).spec.rig
    with_depth = sheet.spec.capture.depth
    channels = stored_channels(sheet.spec.capture)
    count = 3 + with_depth + bool(channels) + (rig.device is not None)
    with place.task_folder() as folder, ExitStack() as opened:
        masters = Masters(place, sheet, frame, folder, artifacts, monitor, count=count, opened=opened)
        layout, inverted = frame_size(rig), rig.imaging_lens is not None
        size = layout.rows, layout.cols
        as_captured = masters.keep(
            names.integral_name(frame), _captured(masters, layout), size, kind=names.PSEUDOSCOPIC
        )
        captured = SheetOfRows(as_captured, layout)
        turned = OrthoscopicSheet(captured, inverted=inverted)
        kept = masters.keep(names.orthoscopic_name(frame), stitched(turned, BAND_PX), size, kind=names.ORTHOSCOPIC)
        upright = SheetOfRows(kept, turned.layout)
        if with_depth:
            _keep_depth(masters, layout, inverted=inverted)
        if channels:
            _keep_channels(masters, layout, channels, inverted=inverted)
        if rig.device is not None:
            _keep_device(masters, upright, rig.device, pitch_mm=rig.lens_array.pitch_mm)
        grid = masters.keep(names.views_name(frame), views_rows(upright, folder), grid_size(upright.layout))
        middle = as_square(_middle_view(grid, upright.layout), upright.layout)
        write_thumbnail(folder / "thumb.webp", middle, longest_px=THUMB_PX)
        artifacts.put(thumb, folder / "thumb.webp")
    return TaskResult(digests=artifacts.stored)


def _captured(masters: Masters, layout: CellLayout) -> Iterator[NDArray[Any]]:
    """Yield the captured image of a frame in bands, from its tiles or from an imported picture."""
    place, sheet, frame = masters.place, masters.sheet, masters.frame
    if sheet.sheets is not None:
        yield imported_sheet(place, sheet, frame, masters.monitor)
    else:
        yield from assembled(layout, _tiles(masters, layout, partial(names.tile_name, frame)))


def _keep_depth(masters: Masters, layout: CellLayout, *, inverted: bool) -> None:
    """Store the depth map of a frame, which has the layout of the orthoscopic integral image."""
    tile_name = partial(names.depth_tile_name, masters.frame)
    shown = _turned(masters, layout, tile_name, CHANNELS, nothing=(np.nan,), inverted=inverted)
    masters.keep_channels(names.depth_name(masters.frame), shown, (layout.rows, layout.cols), CHANNELS)


def _keep_channels(masters: Masters, layout: CellLayout, channels: Sequence[Channel], *, inverted: bool) -> None:
    """Store the other channels of a frame, which have the layout of the orthoscopic integral image."""
    tile_name, parts = partial(names.channel_tile_name, masters.frame), part_names(channels)
    nothing = [NOTHING[channel] for channel in channels for _ in CHANNEL_PARTS[channel]]
    shown = _turned(masters, layout, tile_name, parts, nothing=nothing, inverted=inverted)
    first = tile_name(TileIndex(row=0, col=0))
    with naming_artifact(first), masters.artifacts.opened(first) as path:
        attributes = channel_attributes(channels, objects_in(read_attributes(path)))
    name, size = names.channels_name(masters.frame), (layout.rows, layout.cols)
    masters.keep_channels(name, shown, size, parts, attributes=attributes)


def _turned(
    masters: Masters,
    layout: CellLayout,
    tile_name: Callable[[TileIndex], str],
    parts: Sequence[str],
    *,
    nothing: Sequence[float],
    inverted: bool,
) -> Iterator[NDArray[np.float32]]:
    """Yield the rows of numbers of an orthoscopic integral image, from those of its captured tiles; see `_tiles`."""
    tiles = _tiles(masters, layout, tile_name, channels=parts)
    size = layout.rows, layout.cols
    captured = SheetOfRows(masters.aside(assembled(layout, tiles), size, len(parts)), layout)
    return turned_bands(captured, inverted=inverted, band_px=BAND_PX // len(parts), nothing=nothing)


def on_device(
    upright: NDArray[np.float16], layout: CellLayout, device: Device, *, pitch_mm: float
) -> NDArray[np.float16]:
    """Return an orthoscopic integral image on the pixels of the device that shows it."""
    return to_device(upright, layout, **device_pixels(device, pitch_mm=pitch_mm))


def _keep_device(masters: Masters, upright: Sheet, device: Device, *, pitch_mm: float) -> None:
    """Store the result of `on_device`."""
    grid = device_pixels(device, pitch_mm=pitch_mm)
    masters.keep(
        names.device_name(masters.frame),
        device_bands(upright, **grid),
        device_size(upright.layout, **grid),
        kind=names.ORTHOSCOPIC,
    )


def _middle_view(grid: Rows, layout: CellLayout) -> NDArray[np.float16]:
    u, v = centre(layout)
    row: NDArray[np.float16] = grid.read(v * layout.lens_rows, (v + 1) * layout.lens_rows)
    return row[:, u * layout.lens_cols : (u + 1) * layout.lens_cols]


def _tiles(
    masters: Masters,
    layout: CellLayout,
    name: Callable[[TileIndex], str],
    channels: Sequence[str] | None = None,
) -> Iterator[tuple[Tile, NDArray[Any]]]:
    """Yield a frame's tiles in the order of the sheet, those of a row of them in equal bands if they are large.

    Parameters
    ----------
    name
        The name of the artifact of a tile, below the job.
    channels
        Of numbers in single precision; without them the tiles are light in half floats.
    """
    plan = masters.place.plan_sheet(masters.sheet.job_id)
    tiles = cut_tiles(layout, tile_rows=plan.tile_rows, tile_cols=plan.tile_cols)
    dtype = np.float16 if channels is None else np.float32
    band_px = BAND_PX if channels is None else BAND_PX // len(channels)
    for _, in_a_row in groupby(tiles, key=lambda tile: tile.row_start):
        with ExitStack() as opened:
            beside = []
            for tile in in_a_row:
                with naming_artifact(name(tile.index)):
                    path = opened.enter_context(masters.artifacts.opened(name(tile.index)))
                    picture = opened.enter_context(open_rows(path, dtype=dtype, channels=channels))
                    _check_tile(name(tile.index), picture, tile)
                beside.append((tile, picture))
            for start, stop in _row_bands(beside[0][0], layout, band_px):
                for tile, picture in beside:
                    with naming_artifact(name(tile.index)):
                        pixels = picture.read(start - tile.row_start, stop - tile.row_start)
                    yield replace(tile, row_start=start, row_stop=stop), pixels


def _check_tile(name: str, picture: Rows, tile: Tile) -> None:
    if (picture.rows, picture.cols) != (tile.rows, tile.cols):
        raise ArtifactBroken(f"{name}: expected {tile.rows} x {tile.cols} px, got {picture.rows} x {picture.cols}")


def _row_bands(tile: Tile, layout: CellLayout, band_px: int) -> Iterator[tuple[int, int]]:
    """Yield the pixel rows [start, stop) of bands of a tile, cut between lens rows."""
    first, after = (layout.row_edges.index(row) for row in (tile.row_start, tile.row_stop))
    for start, stop in bands(replace(layout, lens_rows=after - first, first_row_shifted=False), band_px):
        yield layout.row_edges[first + start], layout.row_edges[first + stop]
