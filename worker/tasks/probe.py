"""The first frame, small: does the scene parse, and what does a pixel cost."""

from __future__ import annotations

import math

from lippmann.job.messages.events import MAX_PROBE_NOTES, ProbeResult
from lippmann.job.messages.orders import MOST_THREADS, Order
from lippmann.lattice.layout import CellLayout
from lippmann.plan.sampling import frame_size
from worker.engines.choose import engine_of
from worker.engines.engine import Wanted
from worker.tasks.attempts.attempt import TaskResult
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace, kept_log
from worker.tasks.frames.channels import engine_channels
from worker.tasks.frames.imported import probe_imported
from worker.tasks.frames.picture import room_for
from worker.tasks.frames.render import is_parallel
from worker.tasks.scenes.scene_notes import SceneFindings, examine_scene

PROBE_PX = 20_000
"""Enough for a cost to a few per cent, and rendered in about a second with the paper's rig."""
LEAST_PROBE_PX = 400
"""The least size of the probe, whatever the number of rays of a pixel."""


def probe_job(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
    """Render the first frame of a job with few pixels and measure."""
    sheet = place.job_sheet(order.job_id)
    if sheet.sheets is not None:
        with place.task_folder() as folder, kept_log(place, order, folder) as log:
            return TaskResult(probe=probe_imported(place, sheet, log, monitor))
    rays = sheet.spec.rays_per_px // sheet.spec.capture.supersample**2 * sheet.spec.render.samples
    rows, cols = probe_size(frame_size(sheet.spec.rig), max(LEAST_PROBE_PX, PROBE_PX // rays))
    frame = sheet.spec.frame_numbers[0]
    # Nothing is made of the pixels, so it does not matter whether they depend on the threads.
    threads = min(order.threads, place.settings.slots, MOST_THREADS)
    wanted = Wanted(sheet, frame, rows=rows, cols=cols, channels=engine_channels(sheet), threads=threads)
    with place.task_folder() as folder, kept_log(place, order, folder) as log:
        with room_for(
            place, sheet.at(frame), folder=folder, log=log, monitor=monitor, threads=threads, is_probe=True
        ) as room:
            engine = engine_of(sheet)
            rendered = engine.render(wanted, room)
            # The first picture of a warm engine has its start and its compiler in it, the second one has not.
            again = engine.render(wanted, room) if engine.is_warm else rendered
        # Only scenes of POV-Ray have cameras and files of their own that a note is about.
        is_examined = sheet.engine == "povray"
        seen = (
            examine_scene(place, sheet, folder=folder, log=log, monitor=monitor)
            if is_examined
            else SceneFindings(None, ())
        )
    result = ProbeResult(
        start_s=rendered.start_s,
        s_per_px=again.trace_cpu_s / (rows * cols) * sheet.spec.capture.supersample**2,
        tileable=rendered.tileable,
        parallel=is_parallel(place, sheet.at(frame)),
        camera=seen.camera,
        notes=(*seen.notes, *rendered.notes)[:MAX_PROBE_NOTES],
    )
    return TaskResult(probe=result)


def probe_size(size: CellLayout, px: int = PROBE_PX) -> tuple[int, int]:
    """Return the (rows, cols) of a frame shrunk to about `px` pixels.

    >>> probe_size(CellLayout(lens_rows=90, lens_cols=90, px_per_lens=8))
    (141, 141)
    """
    shrink = min(1.0, math.sqrt(px / size.px))
    return max(1, round(size.rows * shrink)), max(1, round(size.cols * shrink))
