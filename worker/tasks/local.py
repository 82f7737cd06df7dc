"""One frame without a farm: by the same steps that a worker takes, for authors of scenes and for tests."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from lippmann.errors import SpecError
from lippmann.job.messages.events import ProbeResult
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.rendering.channels import stored_channels
from lippmann.job.resolved import ResolvedJob, StoredPlan
from lippmann.job.spec import JobSpec
from lippmann.optics.rig.check import check_job
from lippmann.plan import artifact_names as names
from lippmann.plan.cost import threads_of_each
from lippmann.plan.sampling import Tile, cut_tiles, frame_size
from lippmann.plan.tasks import plan_sheet
from worker.engines.choose import engine_of
from worker.images.convert import png
from worker.sandbox.bundle import check_bundle
from worker.settings import WorkerSettings
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace, workplace
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.render import render_tile
from worker.tasks.probe import probe_job

JOB_ID = "local"

OnProgress = Callable[[str, float], None]
"""Receives the name of the current step and its progress, 0 to 1."""


@dataclass(frozen=True)
class CapturedFrame:
    """The files of a capture."""

    pictures: tuple[Path, ...]
    """PNG and EXR of the integral image, of the orthoscopic image and of the views."""
    notes: tuple[str, ...]
    """Notes about the optics."""


def capture_frame(
    spec: JobSpec, bundle: bytes, *, frame: int, out: Path, on_progress: OnProgress, settings: WorkerSettings
) -> CapturedFrame:
    """Render one frame of a job and write its masters into a folder.

    Raises
    ------
    LippmannError
        Whatever an attempt on the farm would fail with; nothing is left in the folder then.
    """
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="lippmann-capture-"))
        place = workplace(settings.model_copy(update={"data_dir": Path(folder)}), own_files=True)
        # The store is removed with the folder, and its cache with it.
        render = spec.render.model_copy(update={"cache": False})
        one = spec.model_copy(update={"frames": str(frame), "render": render})
        sheet = local_job(place, one, bundle, frames=max(frame, spec.frame_numbers[-1]))
        notes = (*check_bundle(bundle).notes, *check_job(sheet))
        on_progress("probe", 0.0)
        stack.callback(engine_of(sheet).end)  # before the folders of the store go
        probe = _probed(place)
        store_plan(place, plan_sheet(sheet.spec, probe, slots=place.settings.slots, idle_workers=1))
        if sheet.sheets is None:
            _render(place, sheet, frame, on_progress)
        on_progress("assemble", 0.0)
        assemble_frame(place, _order(TaskKind.ASSEMBLE, frame), NullMonitor())
        kept = [names.integral_name(frame), names.orthoscopic_name(frame), names.views_name(frame)]
        if spec.rig.device is not None:
            kept.append(names.device_name(frame))
        pictures = [picture for name in kept for picture in _keep(place, name, out)]
        if spec.capture.depth:
            pictures.append(_keep_master(place, names.depth_name(frame), out))
        if stored_channels(spec.capture):
            pictures.append(_keep_master(place, names.channels_name(frame), out))
        on_progress("assemble", 1.0)
    return CapturedFrame(pictures=tuple(pictures), notes=(*notes, *probe.notes))


def local_job(place: Workplace, spec: JobSpec, bundle: bytes, *, frames: int | None = None) -> ResolvedJob:
    """Store a job and its scene as the service would, and return the job.

    Parameters
    ----------
    frames
        The number of frames of the animation if neither the job nor its scene has one; by default the job's last frame.
    """
    checked = check_bundle(bundle)
    sheet = ResolvedJob.of(JOB_ID, spec, checked.card, bundle=checked.digest, frames=frames)
    place.store.put_bytes(names.bundle_name(checked.digest), bundle)
    place.store.put_bytes(names.job_artifact(JOB_ID, names.JOB_FILE), sheet.model_dump_json().encode())
    return sheet


def store_plan(place: Workplace, plan: StoredPlan) -> None:
    """Store the plan of the job, as the service would."""
    place.store.put_bytes(names.job_artifact(JOB_ID, names.PLAN_FILE), plan.model_dump_json().encode())


def _probed(place: Workplace) -> ProbeResult:
    work = probe_job(place, _order(TaskKind.PROBE, None), NullMonitor())
    assert work.probe is not None  # noqa: S101 - what a probe is for
    return work.probe


def _render(place: Workplace, sheet: ResolvedJob, frame: int, on_progress: OnProgress) -> None:
    plan = place.plan_sheet(JOB_ID)
    tiles = cut_tiles(frame_size(sheet.spec.rig), tile_rows=plan.tile_rows, tile_cols=plan.tile_cols)
    watches = [_Told() for _ in tiles]

    def tell() -> None:
        done = sum(monitor.progress * tile.px for monitor, tile in zip(watches, tiles, strict=True))
        on_progress("render", done / sum(tile.px for tile in tiles))

    for monitor in watches:
        monitor.tell = tell

    threads = threads_of_each(len(tiles), slots=place.settings.slots)

    def render_one(tile: Tile, monitor: _Told) -> None:
        render_tile(place, _order(TaskKind.RENDER, frame, tile, threads=threads), monitor)

    with ThreadPoolExecutor(place.settings.slots) as pool:
        running = [pool.submit(render_one, tile, monitor) for tile, monitor in zip(tiles, watches, strict=True)]
        try:
            for future in running:
                future.result()
        except BaseException:
            for monitor in watches:
                monitor.stopped = True
            raise


class _Told:
    """A progress monitor that forwards the progress."""

    def __init__(self) -> None:
        self.stopped = False
        self.tell: Callable[[], None] = lambda: None
        self._progress = 0.0

    @property
    def progress(self) -> float:
        """The progress of the work, 0 to 1."""
        return self._progress

    @progress.setter
    def progress(self, fraction: float) -> None:
        self._progress = fraction
        self.tell()

    def should_stop(self) -> bool:
        """Return whether another tile has failed."""
        return self.stopped

    def announce_end(self) -> None:
        """Do nothing: no other attempt waits for the core."""


def _order(kind: TaskKind, frame: int | None, tile: Tile | None = None, *, threads: int = 1) -> Order:
    return Order(
        kind=kind,
        job_id=JOB_ID,
        task_id=kind.value,
        attempt="local",
        attempt_number=1,
        frame=frame,
        tile=tile.index if tile else None,
        threads=threads,
    )


def _keep(place: Workplace, name: str, out: Path) -> tuple[Path, Path]:
    target = _keep_master(place, name, out)
    picture, beside = target.with_suffix(".png"), target.with_suffix(".part")
    with _written_beside(beside, out):
        beside.write_bytes(png(target))
        beside.replace(picture)
    return picture, target


def _keep_master(place: Workplace, name: str, out: Path) -> Path:
    target = out / name
    beside = target.with_suffix(".part")
    with _written_beside(beside, out):
        target.parent.mkdir(parents=True, exist_ok=True)
        with place.store.local_path(names.job_artifact(JOB_ID, name)) as path:
            shutil.copyfile(path, beside)
        beside.replace(target)
    return target


@contextmanager
def _written_beside(beside: Path, out: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise SpecError(f"expected a folder that can be written to, got {out}: {error.strerror}") from error
