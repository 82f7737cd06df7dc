"""What many tests start from."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.resolved import ResolvedJob, StoredPlan
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import Tile, cut_tiles, frame_size
from povtemplates.catalogue import scene_folders
from worker.engines.povray.engine import RenderedPicture, render_picture
from worker.engines.povray.pictures.pixels import read_codes
from worker.images.read import read_rgb
from worker.sandbox.bundle import pack_folder
from worker.sandbox.log import AttemptLog
from worker.settings import WorkerSettings
from worker.tasks.attempts.artifacts import TaskArtifacts
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace, workplace
from worker.tasks.frames.picture import room_for
from worker.tasks.frames.render import wanted_region
from worker.tasks.local import JOB_ID, local_job, store_plan


def small_job(scene: str, *, count: tuple[int, int] = (30, 30), px_per_lens: int = 8, **more: Any) -> JobSpec:
    """Return a job of one small frame with the paper's optics.

    `lens_array`, `camera`, `rig` and `tiles` change that part of it; anything else is a field of the job.
    """
    rig: dict[str, Any] = {"lens_array": {"count": list(count), **more.pop("lens_array", {})}}
    rig |= {"px_per_lens": px_per_lens, "camera": more.pop("camera", {}), **more.pop("rig", {})}
    return parse_spec(
        {"scene": scene, "rig": rig, "render": {"tiles": more.pop("tiles", [1, 1]), **more.pop("render", {})}, **more}
    )


def local_place(folder: Path) -> Workplace:
    """Return a worker's place in a folder: real store, real sandbox."""
    return workplace(WorkerSettings(data_dir=folder, slots=1, worker_name="test"))


def builtin_bundle(scene: str) -> bytes:
    """Return the zip of a scene that comes with the project."""
    return pack_folder(scene_folders()[scene])


def stored_job(place: Workplace, spec: JobSpec) -> ResolvedJob:
    """Store a job of a builtin scene, with the tiles that it names, as the service would."""
    sheet = local_job(place, spec, builtin_bundle(spec.scene))
    assert spec.render.tiles != "auto"
    rows, cols = spec.render.tiles
    store_plan(place, StoredPlan(tile_rows=rows, tile_cols=cols, probe_start_s=0.0, probe_s_per_px=0.0))
    return sheet


def order_of(kind: TaskKind, *, frame: int | None = 1, tile: Tile | None = None, output: str | None = None) -> Order:
    """Return the first order for a task of the stored job."""
    index = tile.index if tile else None
    return Order(
        kind=kind, job_id=JOB_ID, task_id="t", attempt="a", attempt_number=1, frame=frame, tile=index, output=output
    )


def artifacts_of(place: Workplace) -> TaskArtifacts:
    """Return the artifacts of the stored job, without expected digests."""
    return TaskArtifacts(place.store, order_of(TaskKind.ENCODE, frame=None), NullMonitor())


def tiles_of(spec: JobSpec) -> tuple[Tile, ...]:
    """Return the tiles that a job with given tiles is cut into."""
    assert spec.render.tiles != "auto"
    rows, cols = spec.render.tiles
    return cut_tiles(frame_size(spec.rig), tile_rows=rows, tile_cols=cols)


@contextmanager
def rendered(place: Workplace, sheet: ResolvedJob, *, tile: Tile | None, **more: Any) -> Iterator[RenderedPicture]:
    """Lend one picture, rendered as a worker does; of a tile or of the whole frame."""
    frame = sheet.spec.frame_numbers[0]
    with (
        place.task_folder() as folder,
        AttemptLog(folder.with_suffix(".txt")) as log,
        room_for(place, sheet.at(frame), folder=folder, log=log, monitor=NullMonitor()) as room,
    ):
        yield render_picture(wanted_region(sheet, frame, tile), room, **more)


def rendered_codes(place: Workplace, sheet: ResolvedJob, *, tile: Tile | None = None) -> NDArray[np.uint16]:
    """Return 16-bit linear codes of a tile or the whole frame, `(rows, cols, 3)`."""
    with rendered(place, sheet, tile=tile, picture_format="ppm16") as picture:
        row_start, row_stop, col_start, col_stop = picture.wanted
        return read_codes(picture.outcome.picture)[row_start:row_stop, col_start:col_stop]


def stored_picture(place: Workplace, name: str) -> NDArray[np.float16]:
    """Return a master of the stored job."""
    with place.store.local_path(names.job_artifact(JOB_ID, name)) as path:
        return read_rgb(path, np.float16)
