"""Where a frame stands, from where its tasks stand."""

from __future__ import annotations

from collections.abc import Collection

from lippmann.job.orders import TaskKind
from lippmann.job.states import ENDED_JOBS, JobStatus, TaskStatus
from service.schemas.frame import FrameStatus


def frame_status(standing: Collection[tuple[TaskKind, TaskStatus]], job: JobStatus) -> FrameStatus:
    """Return where a frame of a job stands: in a job that has ended nothing is being rendered."""
    statuses = {status for _, status in standing}
    if (TaskKind.ASSEMBLE, TaskStatus.DONE) in standing:
        return FrameStatus.DONE
    if TaskStatus.FAILED in statuses:
        return FrameStatus.FAILED
    begun = statuses & {TaskStatus.RUNNING, TaskStatus.DONE}
    return FrameStatus.RENDERING if begun and job not in ENDED_JOBS else FrameStatus.WAITING
