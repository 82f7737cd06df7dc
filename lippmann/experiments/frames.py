"""Render the frames of a job with the steps of a worker (tiles, assembly, videos) in a temporary folder."""

from __future__ import annotations

import resource
import shutil
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.experiments.request import FigureRequest, Report
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.outputs.choice import output_called
from lippmann.job.resolved import ResolvedJob, StoredPlan
from lippmann.job.spec import JobSpec
from lippmann.lattice.layout import CellLayout
from lippmann.optics.rig.check import check_job
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import Tile, cut_tiles, display_size, frame_size
from povtemplates.catalogue import scene_folders
from worker.images.read import read_rgb
from worker.sandbox.bundle import pack_folder
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace, workplace
from worker.tasks.encode import encode_output
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.render import render_tile
from worker.tasks.local import JOB_ID, local_job, store_plan

Light = NDArray[np.float16]


@dataclass(frozen=True)
class LocalJob:
    """A job in a workplace of its own."""

    place: Workplace
    sheet: ResolvedJob

    @property
    def layout(self) -> CellLayout:
        """The layout of the orthoscopic integral images."""
        return display_size(self.sheet.spec.rig)

    def picture(self, name: str) -> Light:
        """Return a master of the job in linear light, `(row, col, channel)`, float16."""
        with self.place.store.local_path(names.job_artifact(JOB_ID, name)) as path:
            return read_rgb(path, np.float16)

    def video(self, output: str, path: Path) -> None:
        """Encode a video of the rendered frames into a file."""
        encode_output(self.place, _order(TaskKind.ENCODE, output=output), NullMonitor())
        name = names.output_name(output_called(self.sheet.spec.outputs, output))
        with self.place.store.local_path(names.job_artifact(JOB_ID, name)) as encoded:
            shutil.copyfile(encoded, path)

    def render(self, report: Report) -> float:
        """Render and assemble every frame, as many tiles at once as there are slots; return the CPU time, s."""
        frames = self.sheet.spec.frame_numbers
        plan = self.place.plan_sheet(JOB_ID)
        size = frame_size(self.sheet.spec.rig)
        tiles = cut_tiles(size, tile_rows=plan.tile_rows, tile_cols=plan.tile_cols)
        cpu_s = self._render_tiles([(frame, tile) for frame in frames for tile in tiles], report)
        for number, frame in enumerate(frames):
            report(0.9 + 0.1 * number / len(frames), f"assemble frame {frame}")
            assemble_frame(self.place, _order(TaskKind.ASSEMBLE, frame=frame), NullMonitor())
        return cpu_s

    def _render_tiles(self, wanted: list[tuple[int, Tile]], report: Report) -> float:
        watches = [_Watched() for _ in wanted]

        def render_one(frame: int, tile: Tile, monitor: _Watched) -> None:
            render_tile(self.place, _order(TaskKind.RENDER, frame=frame, tile=tile), monitor)
            monitor.progress = 1.0
            done = sum(each.progress for each in watches) / len(watches)
            report(0.9 * done, f"rendered {done:.0%}")

        before_s = _cpu_s_of_children()
        with ThreadPoolExecutor(self.place.settings.slots) as pool:
            running = [pool.submit(render_one, *one, monitor) for one, monitor in zip(wanted, watches, strict=True)]
            try:
                for future in running:
                    future.result()
            except BaseException:
                for monitor, future in zip(watches, running, strict=True):
                    monitor.stopped = True
                    future.cancel()
                raise
        return _cpu_s_of_children() - before_s


def _cpu_s_of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


@contextmanager
def prepared(spec: JobSpec, request: FigureRequest) -> Iterator[LocalJob]:
    """Yield a job that is stored, checked and cut into one tile for each slot.

    Raises
    ------
    lippmann.errors.LippmannError
        If the job cannot be rendered.
    """
    with tempfile.TemporaryDirectory(prefix="lippmann-paper-") as folder:
        place = workplace(request.settings.model_copy(update={"data_dir": Path(folder)}), own_files=True)
        sheet = local_job(place, spec, pack_folder(scene_folders()[spec.scene]))
        check_job(sheet)
        slots = place.settings.slots if spec.render.may_be_tiled else 1
        store_plan(place, StoredPlan(tile_rows=slots, tile_cols=1, probe_start_s=0.0, probe_s_per_px=0.0))
        yield LocalJob(place, sheet)


class _Watched:
    """The progress of one tile, and whether it must stop because another has failed."""

    def __init__(self) -> None:
        self.progress = 0.0
        self.stopped = False

    def should_stop(self) -> bool:
        return self.stopped

    def announce_end(self) -> None: ...


def _order(kind: TaskKind, *, frame: int | None = None, tile: Tile | None = None, output: str | None = None) -> Order:
    index = tile.index if tile else None
    return Order(
        kind=kind, job_id=JOB_ID, task_id=kind.value, attempt="local", attempt_number=1, frame=frame, tile=index,
        output=output,
    )  # fmt: skip
