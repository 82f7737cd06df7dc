"""Tiles -> integral image -> orthoscopic -> views -> thumbnail."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from worker.errors import Stopped
from worker.images.read import read_rgb
from worker.images.write import write_exr, write_thumbnail
from worker.integral.assemble import assemble
from worker.integral.orthoscopic import orthoscopic
from worker.integral.views import centre, view, views_grid
from worker.job.orders import Order
from worker.job.sheet import JobSheet, PlanSheet
from worker.plan import names
from worker.plan.sampling import Tile, cut_tiles, frame_size
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
    layout = frame_size(sheet.spec.rig)
    captured = assemble(layout, _tiles(place, sheet, place.plan_sheet(order.job_id), order.frame, watch))
    with place.task_folder() as folder:
        _store(place, sheet, order.frame, names.integral_name(order.frame), captured, folder)
        upright = orthoscopic(captured, layout)
        del captured
        _store(place, sheet, order.frame, names.orthoscopic_name(order.frame), upright, folder)
        _store(place, sheet, order.frame, names.views_name(order.frame), views_grid(upright, layout), folder)
        write_thumbnail(folder / "thumb.webp", view(upright, layout, *centre(layout)), longest_px=THUMB_PX)
        place.store.put_file(thumb, folder / "thumb.webp")
    return Work()


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


def _store(place: Workplace, sheet: JobSheet, frame: int, name: str, linear: NDArray[np.float16], folder: Path) -> None:
    picture = folder / "picture.exr"
    write_exr(picture, linear, attributes=header(sheet, frame))
    place.store.put_file(names.job_artifact(sheet.job_id, name), picture)
