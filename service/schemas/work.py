"""The work of the farm: the tasks of workers, the jobs that wait, the work of the last hours, and that of owners."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum

from lippmann.job.messages.orders import TaskKind, TileIndex
from lippmann.job.states import TaskStatus
from service.schemas.answer import Answer
from service.schemas.wait import WaitCode


class StuckCode(StrEnum):
    """The sign by which a task seems to be stuck."""

    SILENT = "silent"
    SLOW = "slow"
    NOT_CLAIMED = "not-claimed"


class Stuck(Answer):
    """Why a task seems to be stuck."""

    code: StuckCode
    message: str
    """The sentence that a user reads."""


class FarmTask(Answer):
    """A task that a worker runs, or whose order is sent."""

    id: str
    job_id: str
    job_title: str
    """The title of the job, or the name of its scene."""
    owner_id: str
    kind: TaskKind
    status: TaskStatus
    frame: int | None
    tile: TileIndex | None
    output: str | None
    """The file name of the output that the task encodes."""
    worker: str | None
    """The worker that runs it; null while its order is in the queue."""
    progress: float | None
    """The finished part, 0 to 1."""
    attempt_number: int
    dispatched_at: datetime | None
    started_at: datetime | None
    heard_at: datetime | None
    """The time of the last heartbeat of the attempt."""
    stuck: Stuck | None = None
    """Why the task seems to be stuck; null if it does not."""
    picture: str | None = None
    """The path of a small picture: the newest frame of the job that is done, or else the poster of its scene."""


class WaitingJobs(Answer):
    """Jobs that wait for the same reason and need the same engine."""

    engine: str
    """The engine that the jobs need; `none` for jobs that render nothing."""
    code: WaitCode
    message: str
    """The sentence of the first of these jobs."""
    jobs: int
    ready_tasks: int
    """The number of their tasks that only wait for a slot."""
    first: tuple[str, ...]
    """The ids of these jobs, first the one of the highest priority, up to ten."""


class FarmWork(Answer):
    """The work of the farm now. Jobs that the caller does not see are left out."""

    tasks: tuple[FarmTask, ...]
    """The tasks that workers run and those whose orders are sent, at most 500."""
    waiting: tuple[WaitingJobs, ...]
    """The jobs that wait, by engine and reason, the most first; of at most 500 jobs, oldest first."""
    more: bool
    """True if more tasks or jobs were there than are listed."""
    free_bytes: int | None
    """The free space of the artifact store in bytes; null if it does not answer or has no limit."""
    free_files: int | None
    """The number of further files (inodes) that the store takes; null if it does not answer or has no limit."""
    artifact_bytes: int | None
    """The bytes of the artifacts of all owners; null if the database does not answer."""


class FarmHistory(Answer):
    """The work of the last hours, in steps of equal length. Attempts that were repeated are not in it."""

    begins_at: datetime
    step_s: float
    """The length of a step in seconds; the last step ends now."""
    frames: tuple[int, ...]
    """The number of frames that were finished in each step."""
    slots: tuple[float, ...]
    """The mean number of slots in use in each step."""


class OwnerWork(Answer):
    """The stored jobs of an owner that were submitted with keys of one name, and what they took."""

    owner_id: str
    name: str
    """The name of the key or the account that submitted the jobs."""
    jobs: int
    open_jobs: int
    running_tasks: int
    frames_done: int
    cpu_s: float
    """The CPU time of their tasks, in seconds."""
    artifact_bytes: int


class OwnerWorkList(Answer):
    """The use of the farm by owner, the most CPU time first, at most 1000 owners. Removed jobs are not counted."""

    items: tuple[OwnerWork, ...]
