"""What a job is without a farm: the pixels that every farm must make, whatever fails meanwhile."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.job.messages.orders import TaskKind
from lippmann.job.spec import JobSpec
from lippmann.plan import artifact_names as names
from tests.builders import local_place, order_of, stored_job, stored_picture, tiles_of
from worker.engines.choose import ENGINES
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.render import render_tile


def masters_without_farm(folder: Path, spec: JobSpec) -> dict[int, NDArray[np.float16]]:
    """Return the orthoscopic master of each frame of a job that names its tiles, rendered in this process."""
    place = local_place(folder)
    stored_job(place, spec)
    masters = {}
    for frame in spec.frame_numbers:
        for tile in tiles_of(spec):
            render_tile(place, order_of(TaskKind.RENDER, frame=frame, tile=tile), NullMonitor())
        assemble_frame(place, order_of(TaskKind.ASSEMBLE, frame=frame), NullMonitor())
        masters[frame] = stored_picture(place, names.orthoscopic_name(frame))
    for engine in ENGINES.values():
        engine.end()
    return masters
