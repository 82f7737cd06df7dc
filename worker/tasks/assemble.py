"""Tiles -> integral image -> orthoscopic -> views -> thumbnail."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from worker.errors import Stopped
from worker.images.read import read_channels, read_rgb
from worker.images.write import write_channels, write_exr, write_thumbnail
from worker.integral.assemble import assemble
from worker.integral.depth_map import CHANNELS, orthoscopic_depth
from worker.integral.device import to_device
from worker.integral.layout import CellLayout
from worker.integral.orthoscopic import orthoscopic
from worker.integral.square_pixels import as_square
from worker.integral.views import centre, view, views_grid
from worker.job.orders import Order
from worker.job.rig import Device
from worker.job.sheet import JobSheet, PlanSheet
from worker.plan import names
from worker.plan.sampling import Tile, cut_tiles, display_size, frame_size
from worker.tasks.attempt import Work
from worker.tasks.render import header
from worker.tasks.watch import Watch
from worker.tasks.workplace import Workplace

THUMB_PX = 256
"""Longer side of a thumbnail."""


def assemble_frame(place: Workplace, order: Order, watch: Watch) -> Work:
    """Make a frame's tiles into everything that is shown of it; the thumbnail last, so that it means all is there."""
    assert order.frame is not None  # noqa: S101 - the dispatcher's promise
    thumb = names.job_artifact(order.job_id, names.thumb_name(order.frame))
    if place.store.exists(thumb):
        return Work()
    sheet = place.job_sheet(order.job_id)
    rig, frame = sheet.at(order.frame).spec.rig, order.frame
    captured = assemble(frame_size(rig), _tiles(place, sheet, place.plan_sheet(order.job_id), frame, watch))
    with place.task_folder() as folder:

        def store(name: str, linear: NDArray[np.float16]) -> None:
            _store(place, sheet, frame, name, linear, folder)

        store(names.integral_name(frame), captured)
        upright = orthoscopic(captured, frame_size(rig), inverted=rig.imaging_lens is not None)
        del captured
        store(names.orthoscopic_name(frame), upright)
        if sheet.spec.capture.depth:
            _store_depth(place, sheet, frame, watch, folder)
        layout = display_size(rig)
        if rig.device is not None:
            store(names.device_name(frame), on_device(upright, layout, rig.device, pitch_mm=rig.lens_array.pitch_mm))
        store(names.views_name(frame), views_grid(upright, layout))
        middle = as_square(view(upright, layout, *centre(layout)), layout)
        write_thumbnail(folder / "thumb.webp", middle, longest_px=THUMB_PX)
        place.store.put_file(thumb, folder / "thumb.webp")
    return Work()


def on_device(
    upright: NDArray[np.float16], layout: CellLayout, device: Device, *, pitch_mm: float
) -> NDArray[np.float16]:
    """Return an orthoscopic integral image on the pixels of the device that shows it."""
    return to_device(
        upright,
        layout,
        px_per_lens_device=pitch_mm / device.pixel_mm,
        window=device.window_px,
        margin_px=device.margin_px,
    )


def _tiles(
    place: Workplace, sheet: JobSheet, plan: PlanSheet, frame: int, watch: Watch
) -> Iterator[tuple[Tile, NDArray[np.float16]]]:
    tiles = cut_tiles(frame_size(sheet.spec.rig), tile_rows=plan.tile_rows, tile_cols=plan.tile_cols)
    for number, tile in enumerate(tiles):
        if watch.should_stop():
            raise Stopped
        watch.progress = number / len(tiles)
        with place.store.local_path(names.job_artifact(sheet.job_id, names.tile_name(frame, tile.index))) as path:
            yield tile, read_rgb(path, np.float16)


def _store_depth(place: Workplace, sheet: JobSheet, frame: int, watch: Watch, folder: Path) -> None:
    """Store the depth of a frame, which lies as the orthoscopic integral image does."""
    rig = sheet.at(frame).spec.rig
    plan = place.plan_sheet(sheet.job_id)

    def tiles() -> Iterator[tuple[Tile, NDArray[np.float32]]]:
        for tile in cut_tiles(frame_size(rig), tile_rows=plan.tile_rows, tile_cols=plan.tile_cols):
            if watch.should_stop():
                raise Stopped
            name = names.job_artifact(sheet.job_id, names.depth_tile_name(frame, tile.index))
            with place.store.local_path(name) as path:
                yield tile, read_channels(path, CHANNELS)

    captured = assemble(frame_size(rig), tiles())
    upright = orthoscopic_depth(captured, frame_size(rig), inverted=rig.imaging_lens is not None)
    write_channels(folder / "depth.exr", upright.values, CHANNELS, attributes=header(sheet, frame))
    place.store.put_file(names.job_artifact(sheet.job_id, names.depth_name(frame)), folder / "depth.exr")


def _store(place: Workplace, sheet: JobSheet, frame: int, name: str, linear: NDArray[np.float16], folder: Path) -> None:
    picture = folder / "picture.exr"
    write_exr(picture, linear, attributes=header(sheet, frame))
    place.store.put_file(names.job_artifact(sheet.job_id, name), picture)
