"""The pixels of a preview, and the two pictures of them: the orthoscopic integral image, and the view in the middle."""

from __future__ import annotations

import resource
import time
from base64 import b64encode
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.messages.previews import MAX_NOTES, PreviewMade
from lippmann.job.resolved import ResolvedJob
from lippmann.lightfield.sheet.orthoscopic import orthoscopic, orthoscopic_layout
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, view
from lippmann.plan.sampling import frame_size
from worker.engines.choose import engine_of
from worker.engines.engine import Room, Wanted
from worker.images.write import encoded_png
from worker.sandbox.child import lost_cpu
from worker.sandbox.limits import Limits, TimeLimit, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames.picture import CPU_PER_SECOND, room_for
from worker.tasks.previews.camera import KnownCameras


def render_preview(
    place: Workplace,
    job: ResolvedJob,
    frame: int,
    *,
    limit: TimeLimit,
    cameras: KnownCameras,
    monitor: ProgressMonitor,
) -> PreviewMade:
    """Render the job of a preview and return its pictures.

    A warm engine keeps its scene for the next preview of the same owner.

    Parameters
    ----------
    job
        The job of a preview, at its frame; see `lippmann.plan.preview`.
    frame
        The number of the frame.
    limit
        The longest time of the engine.
    cameras
        The cameras of the scenes of earlier previews.
    monitor
        Knows whether the preview is still wanted.

    Raises
    ------
    LippmannError
        If the scene is refused, the limit is passed, the preview is not wanted any more, or the engine fails.
    """
    began_cpu_s = _cpu_s()
    size = frame_size(job.spec.rig)
    wanted = Wanted(job, frame, rows=size.rows, cols=size.cols)
    with place.task_folder() as folder, AttemptLog(folder / "preview.txt") as log:
        began_s = time.monotonic()
        stage = cameras.stage(place, job, frame, folder=folder, log=log, monitor=monitor)
        wanted = replace(wanted, job=job.placed(stage, frame))
        with room_for(place, wanted.job, folder=folder, log=log, monitor=monitor) as room:
            rendered = engine_of(job).render(wanted, _limited(room, limit))
    rendered_s = time.monotonic()
    layout, inverted = size, job.spec.rig.imaging_lens is not None
    light = rendered.light.astype(np.float32)
    shown, upright = orthoscopic(light, layout, inverted=inverted), orthoscopic_layout(layout, inverted=inverted)
    middle = as_square(view(shown, upright, *centre(upright)), upright)
    integral_png, view_png = _png(shown), _png(middle)
    return PreviewMade(
        integral_png=integral_png,
        integral_size=shown.shape[:2],
        view_png=view_png,
        view_size=middle.shape[:2],
        start_s=rendered.start_s,
        render_s=rendered_s - began_s,
        pictures_s=time.monotonic() - rendered_s,
        cpu_s=max(0.0, _cpu_s() - began_cpu_s),
        notes=rendered.notes[:MAX_NOTES],
    )


def _limited(room: Room, limit: TimeLimit) -> Room:
    """Return a room with the limits of a preview, which are the same for every preview of a worker."""
    limits = Limits(cpu_s=CPU_PER_SECOND * limit.seconds, memory_mb=room.limits.memory_mb)
    return replace(room, limits=limits, times=TimeLimits(total=limit, stall=limit))


def _png(linear: NDArray[Any]) -> str:
    with encoded_png(linear, bits=8) as file:
        return b64encode(file.read()).decode("ascii")


def _cpu_s() -> float:
    """Return the CPU seconds of this process and of all below it."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + used.ru_utime + used.ru_stime + lost_cpu.seconds
