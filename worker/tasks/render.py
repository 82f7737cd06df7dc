"""A frame, or a tile of it, into the store."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.job.messages.orders import MOST_THREADS, Order, TileIndex
from lippmann.job.resolved import ResolvedJob, StoredPlan
from lippmann.lightfield.depth.depth_map import CHANNELS, DepthMap
from lippmann.lightfield.sheet.supersample import average_in_cells
from lippmann.optics.rig.bench import bench
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import Tile, cut_tiles, frame_size
from worker.engines.choose import engine_of
from worker.engines.engine import Region, Rendered, Wanted
from worker.images.write import write_channels, write_exr
from worker.sandbox.log import AttemptLog
from worker.tasks.artifacts import TaskArtifacts
from worker.tasks.attempt import TaskResult
from worker.tasks.depth_pass import depth_map, depth_of_tile
from worker.tasks.monitor import PartMonitor, ProgressMonitor
from worker.tasks.picture import room_for
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
                found = _depth(place, sheet, order.frame, tile, folder, log, PartMonitor(monitor, 0.0, 0.5))
                _store_depth(found, sheet, order, tile, artifacts, folder)
            rest = PartMonitor(monitor, 0.5, 1.0) if depth else monitor
            threads = threads_of(place, sheet.at(order.frame), order)
            rendered = render_region(
                place, sheet, order.frame, tile, folder=folder, log=log, monitor=rest, threads=threads
            )
        cropped = folder / "tile.exr"
        write_exr(cropped, _pixels(rendered, sheet, tile), attributes=tile_header(sheet, order.frame))
        if rendered.source is not None:
            text = names.job_artifact(order.job_id, names.pov_name(order.frame, order.tile))
            place.store.put_file(text, rendered.source)
        artifacts.put(names.tile_name(order.frame, order.tile), cropped)
    if cache is not None:
        cache.keep()
    return TaskResult(digests=artifacts.stored)


def threads_of(place: Workplace, sheet: ResolvedJob, order: Order) -> int:
    """Return the number of threads that trace the tile of an order, whose job is given at its frame."""
    threads = min(order.threads, place.settings.slots, MOST_THREADS)
    return threads if threads > 1 and is_parallel(place, sheet) else 1


def is_parallel(place: Workplace, sheet: ResolvedJob) -> bool:
    """Return whether the engine may render a picture of a job, given at its frame, by several threads."""
    with place.bundle(sheet.bundle) as bundle:
        return engine_of(sheet).is_parallel(sheet, bundle)


def _depth(
    place: Workplace,
    sheet: ResolvedJob,
    frame: int,
    tile: Tile,
    folder: Path,
    log: AttemptLog,
    monitor: ProgressMonitor,
) -> DepthMap:
    """Return the depth of a tile, by the engine's channel or else by a second pass of POV-Ray."""
    engine = engine_of(sheet)
    if not engine.has_channels:
        return depth_of_tile(place, sheet, frame, tile, folder=folder, log=log, monitor=monitor)
    there, layout = sheet.at(frame), sheet.spec.rig.layout
    region = Region(tile.row_start, tile.row_stop, tile.col_start, tile.col_stop)
    # One ray a pixel, through its centre, however many the picture has.
    wanted = Wanted(sheet, frame, rows=layout.rows, cols=layout.cols, region=region, channels=("depth",))
    with room_for(place, there, folder=folder, log=log, monitor=monitor) as room:
        distance_mm = engine.render(wanted, room).channels["depth"]
    optical_bench = bench(there.spec.rig, reference_mm=there.stage.reference_mm)
    return depth_map(distance_mm, optical_bench, tile, monitor)


def _store_depth(
    found: DepthMap, sheet: ResolvedJob, order: Order, tile: Tile, artifacts: TaskArtifacts, folder: Path
) -> None:
    """Store the depth of a tile; of the two the tile itself comes last and means both."""
    assert order.frame is not None  # noqa: S101 - as in render_tile
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
    threads: int = 1,
) -> Rendered:
    """Render a tile, or the whole frame, with as many pixels as the job supersamples by."""
    with room_for(place, sheet.at(frame), folder=folder, log=log, monitor=monitor, threads=threads) as room:
        return engine_of(sheet).render(wanted_region(sheet, frame, tile, threads=threads), room)


def wanted_region(sheet: ResolvedJob, frame: int, tile: Tile | None, *, threads: int = 1) -> Wanted:
    """Return the pixels of a tile, or of the whole frame, as many as the job supersamples by."""
    size, k = frame_size(sheet.spec.rig), sheet.spec.capture.supersample
    edges = (tile.row_start, tile.row_stop, tile.col_start, tile.col_stop) if tile else None
    region = Region(*(edge * k for edge in edges)) if edges else None
    return Wanted(sheet, frame, rows=size.rows * k, cols=size.cols * k, region=region, threads=threads)


def _pixels(rendered: Rendered, sheet: ResolvedJob, tile: Tile) -> NDArray[np.float16]:
    """Return a tile's pixels, averaged inside their cells if there are more than one for each."""
    k = sheet.spec.capture.supersample
    fine = rendered.light
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
