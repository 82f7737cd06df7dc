"""A frame, or a tile of it, into the store."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.job.messages.orders import MOST_THREADS, Order, TileIndex
from lippmann.job.resolved import ResolvedJob, StoredPlan
from lippmann.lightfield.depth.depth_map import CHANNELS
from lippmann.lightfield.sheet.supersample import average_in_cells
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import Tile, cut_tiles, frame_size
from worker.engines.povray.command import PictureFormat, Region
from worker.engines.povray.pixels import read_region
from worker.images.write import write_channels, write_exr
from worker.sandbox.log import AttemptLog
from worker.tasks.artifacts import TaskArtifacts
from worker.tasks.attempt import TaskResult
from worker.tasks.depth_pass import depth_of_tile
from worker.tasks.monitor import PartMonitor, ProgressMonitor
from worker.tasks.picture import POV_FILE, RenderedPicture, is_parallel, render_picture
from worker.tasks.render_cache import tile_cache
from worker.tasks.scene_camera import rendered_job
from worker.tasks.workplace import Workplace, kept_log


def render_tile(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
    """Render the tile that an order names, crop it and store it; one that is stored or cached is not rendered."""
    assert order.frame is not None  # noqa: S101 - the dispatcher's promise
    assert order.tile is not None  # noqa: S101 - see above
    sheet, artifacts = place.job_sheet(order.job_id), TaskArtifacts(place.store, order)
    if all(artifacts.exists(name) for name in names.tile_artifacts(sheet.spec, order.frame, order.tile)):
        return TaskResult(digests=artifacts.stored)
    sheet = rendered_job(place, order, monitor)
    tile = tile_of(sheet, place.plan_sheet(order.job_id), order.tile)
    cache = tile_cache(place, sheet, order, tile, artifacts)
    if cache is not None and cache.take():
        return TaskResult(digests=artifacts.stored, cached=True)
    depth = sheet.spec.capture.depth
    with place.task_folder() as folder:
        with kept_log(place, order, folder) as log:
            if depth:
                _store_depth(place, sheet, order, tile, artifacts, folder, log, PartMonitor(monitor, 0.0, 0.5))
            rest = PartMonitor(monitor, 0.5, 1.0) if depth else monitor
            threads = threads_of(place, sheet.at(order.frame), order)
            picture = render_region(
                place, sheet, order.frame, tile, folder=folder, log=log, monitor=rest, threads=threads
            )
        cropped = folder / "tile.exr"
        write_exr(cropped, _pixels(picture, sheet, tile), attributes=tile_header(sheet, order.frame))
        text = names.job_artifact(order.job_id, names.pov_name(order.frame, order.tile))
        place.store.put_file(text, folder / POV_FILE)
        artifacts.put(names.tile_name(order.frame, order.tile), cropped)
    if cache is not None:
        cache.keep()
    return TaskResult(digests=artifacts.stored)


def threads_of(place: Workplace, sheet: ResolvedJob, order: Order) -> int:
    """Return the number of threads that trace the tile of an order, whose job is given at its frame."""
    threads = min(order.threads, place.settings.slots, MOST_THREADS)
    return threads if threads > 1 and is_parallel(place, sheet) else 1


def _store_depth(
    place: Workplace,
    sheet: ResolvedJob,
    order: Order,
    tile: Tile,
    artifacts: TaskArtifacts,
    folder: Path,
    log: AttemptLog,
    monitor: ProgressMonitor,
) -> None:
    """Store the depth of a tile; of the two the tile itself comes last and means both."""
    assert order.frame is not None  # noqa: S101 - as in render_tile
    found = depth_of_tile(place, sheet, order.frame, tile, folder=folder, log=log, monitor=monitor)
    path = folder / "depth.exr"
    size = found.values.shape[:2]
    write_channels(path, (found.values,), CHANNELS, size=size, attributes=tile_header(sheet, order.frame))
    artifacts.put(names.depth_tile_name(order.frame, tile.index), path)


def render_region(
    place: Workplace,
    sheet: ResolvedJob,
    frame: int,
    tile: Tile | None,
    *,
    folder: Path,
    log: AttemptLog,
    monitor: ProgressMonitor,
    picture_format: PictureFormat = "exr",
    threads: int = 1,
) -> RenderedPicture:
    """Render a tile, or the whole frame, with as many pixels as the job supersamples by."""
    size, k = frame_size(sheet.spec.rig), sheet.spec.capture.supersample
    edges = (tile.row_start, tile.row_stop, tile.col_start, tile.col_stop) if tile else None
    return render_picture(
        place,
        sheet,
        frame=frame,
        rows=size.rows * k,
        cols=size.cols * k,
        region=Region(*(edge * k for edge in edges)) if edges else None,
        folder=folder,
        log=log,
        monitor=monitor,
        picture_format=picture_format,
        threads=threads,
    )


def _pixels(picture: RenderedPicture, sheet: ResolvedJob, tile: Tile) -> NDArray[np.float16]:
    """Return a tile's pixels: cropped, and averaged inside their cells if there are more than one for each."""
    k = sheet.spec.capture.supersample
    fine = read_region(picture.outcome.picture, picture.wanted)
    if k == 1:
        return fine
    layout = frame_size(sheet.spec.rig)
    return average_in_cells(fine, layout, k, row_start=tile.row_start, col_start=tile.col_start)


def tile_of(sheet: ResolvedJob, plan: StoredPlan, index: TileIndex) -> Tile:
    """Return the tile of a plan at an index."""
    tiles = cut_tiles(frame_size(sheet.spec.rig), tile_rows=plan.tile_rows, tile_cols=plan.tile_cols)
    return next(tile for tile in tiles if tile.index == index)


def tile_header(sheet: ResolvedJob, frame: int) -> dict[str, str]:
    """Return the header attributes of a tile: those of a master without the job and the frame, which may be others."""
    return {name: text for name, text in header(sheet, frame).items() if name not in ("job", "frame")}


def header(sheet: ResolvedJob, frame: int) -> dict[str, str]:
    """Return the header attributes of a master: the rig and the stage as JSON, the job and the frame."""
    there = sheet.at(frame)
    return {
        "job": sheet.job_id,
        "frame": str(frame),
        "scene": sheet.spec.scene,
        "bundle": sheet.bundle,
        "rig": there.spec.rig.model_dump_json(),
        **({"stage": there.stage.model_dump_json()} if sheet.sheets is None else {}),
    }
