"""A frame, or a tile of it, into the store."""

from __future__ import annotations

import numpy as np

from worker.images.read import read_region
from worker.images.write import write_exr
from worker.job.orders import Order, TileIndex
from worker.job.sheet import JobSheet, PlanSheet
from worker.plan import names
from worker.plan.sampling import Tile, cut_tiles, frame_size
from worker.tasks.attempt import Work
from worker.tasks.logs import kept_log
from worker.tasks.picture import POV_FILE, render_picture
from worker.tasks.watch import Watch
from worker.tasks.workplace import Workplace


def render_tile(place: Workplace, order: Order, watch: Watch) -> Work:
    """Render the tile that an order names, crop it and store it; if it is there already, that is all."""
    assert order.frame is not None  # noqa: S101 - the dispatcher's promise
    assert order.tile is not None  # noqa: S101
    artifact = names.job_artifact(order.job_id, names.tile_name(order.frame, order.tile))
    if place.store.exists(artifact):
        return Work()
    sheet = place.job_sheet(order.job_id)
    size = frame_size(sheet.spec.rig)
    tile = tile_of(sheet, place.plan_sheet(order.job_id), order.tile)
    with place.task_folder() as folder:
        with kept_log(place, order, folder) as log:
            outcome = render_picture(
                place,
                sheet,
                frame=order.frame,
                rows=size.rows,
                cols=size.cols,
                tile=tile,
                folder=folder,
                log=log,
                watch=watch,
            )
        cropped = folder / "tile.exr"
        write_exr(cropped, read_region(outcome.picture, tile, np.float16), attributes=header(sheet, order.frame))
        text = names.job_artifact(order.job_id, names.pov_name(order.frame, order.tile))
        place.store.put_file(text, folder / POV_FILE)
        place.store.put_file(artifact, cropped)
    return Work(cpu_s=outcome.cpu_s)


def tile_of(sheet: JobSheet, plan: PlanSheet, index: TileIndex) -> Tile:
    """Return the tile of a plan at an index."""
    tiles = cut_tiles(frame_size(sheet.spec.rig), tile_rows=plan.tile_rows, tile_cols=plan.tile_cols)
    return next(tile for tile in tiles if tile.index == index)


def header(sheet: JobSheet, frame: int) -> dict[str, str]:
    """Return what a master says about itself: the rig and the stage as JSON, the job and the frame."""
    return {
        "job": sheet.job_id,
        "frame": str(frame),
        "scene": sheet.spec.scene,
        "bundle": sheet.bundle,
        "rig": sheet.spec.rig.model_dump_json(),
        "stage": sheet.stage.model_dump_json(),
    }
