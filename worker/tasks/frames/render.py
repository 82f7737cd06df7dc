"""A frame, or a tile of it, into the store."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.job.messages.orders import MOST_THREADS, Order, TileIndex
from lippmann.job.rendering.render_settings import Channel
from lippmann.job.resolved import ResolvedJob, StoredPlan
from lippmann.lightfield.sheet.supersample import average_in_cells
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import Tile, cut_tiles, frame_size
from worker.engines.choose import engine_of
from worker.engines.engine import Region, Rendered, Wanted
from worker.images.write import write_exr
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.artifacts import TaskArtifacts
from worker.tasks.attempts.attempt import TaskResult
from worker.tasks.attempts.monitor import PartMonitor, ProgressMonitor
from worker.tasks.attempts.workplace import Workplace, kept_log
from worker.tasks.frames.channels import TileChannels, channels_of, engine_channels, store_channels
from worker.tasks.frames.depth_pass import depth_of_tile
from worker.tasks.frames.picture import room_for
from worker.tasks.frames.render_cache import tile_cache
from worker.tasks.scenes.scene_camera import rendered_job


def render_tile(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
    """Render the tile that an order names, crop it and store it; one that is stored or cached is not rendered."""
    assert order.frame is not None  # noqa: S101 - the dispatcher's promise
    assert order.tile is not None  # noqa: S101 - see above
    sheet, artifacts = place.job_sheet(order.job_id), TaskArtifacts(place.store, order, monitor)
    if all(artifacts.exists(name) for name in names.tile_artifacts(sheet.spec, order.frame, order.tile)):
        return TaskResult(digests=artifacts.stored)
    sheet = rendered_job(place, order, monitor)
    tile = tile_of(sheet, place.plan_sheet(order.job_id), order.tile)
    cache = tile_cache(place, sheet, order, tile, artifacts)
    if cache is not None and cache.take():
        return TaskResult(digests=artifacts.stored, cached=True)
    with place.task_folder() as folder:
        with kept_log(place, order, folder) as log:
            rendered, found = _rendered(place, sheet, order, tile, folder=folder, log=log, monitor=monitor)
        attributes = tile_header(sheet, order.frame)
        store_channels(found, order, tile, artifacts, folder, attributes=attributes)
        cropped = folder / "tile.exr"
        write_exr(cropped, _pixels(rendered, sheet, tile), attributes=attributes)
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


def _rendered(
    place: Workplace,
    sheet: ResolvedJob,
    order: Order,
    tile: Tile,
    *,
    folder: Path,
    log: AttemptLog,
    monitor: ProgressMonitor,
) -> tuple[Rendered, TileChannels]:
    """Render a tile and what it has besides its colours, in one pass where the engine and the samples allow it."""
    assert order.frame is not None  # noqa: S101 - as in render_tile
    frame, channels = order.frame, engine_channels(sheet)
    threads = threads_of(place, sheet.at(frame), order)
    is_one_pass = sheet.spec.capture.supersample == 1
    found = TileChannels()
    rest = monitor
    if sheet.spec.capture.depth and not channels:
        half = PartMonitor(monitor, 0.0, 0.5)
        found = TileChannels(depth_of_tile(place, sheet, frame, tile, folder=folder, log=log, monitor=half))
        rest = PartMonitor(monitor, 0.5, 1.0)
    elif channels and not is_one_pass:
        # One ray a pixel, through its centre, however many the picture has.
        half = PartMonitor(monitor, 0.0, 0.5)
        wanted = wanted_region(sheet, frame, tile, channels=channels, light=False)
        with room_for(place, sheet.at(frame), folder=folder, log=log, monitor=half) as room:
            found = channels_of(engine_of(sheet).render(wanted, room), sheet, frame, tile, half)
        rest = PartMonitor(monitor, 0.5, 1.0)
    with_light = channels if is_one_pass else ()
    rendered = render_region(
        place, sheet, frame, tile, folder=folder, log=log, monitor=rest, threads=threads, channels=with_light
    )
    return rendered, channels_of(rendered, sheet, frame, tile, rest) if with_light else found


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
    channels: tuple[Channel, ...] = (),
) -> Rendered:
    """Render a tile, or the whole frame, with as many pixels as the job supersamples by."""
    with room_for(place, sheet.at(frame), folder=folder, log=log, monitor=monitor, threads=threads) as room:
        wanted = wanted_region(sheet, frame, tile, threads=threads, channels=channels)
        return engine_of(sheet).render(wanted, room)


def wanted_region(
    sheet: ResolvedJob,
    frame: int,
    tile: Tile | None,
    *,
    threads: int = 1,
    channels: tuple[Channel, ...] = (),
    light: bool = True,
) -> Wanted:
    """Return the pixels of a tile, or of the whole frame: as many as the job supersamples by, or one without light."""
    size, k = frame_size(sheet.spec.rig), sheet.spec.capture.supersample if light else 1
    edges = (tile.row_start, tile.row_stop, tile.col_start, tile.col_stop) if tile else None
    region = Region(*(edge * k for edge in edges)) if edges else None
    return Wanted(
        sheet,
        frame,
        rows=size.rows * k,
        cols=size.cols * k,
        region=region,
        channels=channels,
        light=light,
        threads=threads,
    )


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
