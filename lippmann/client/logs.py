"""The logs of the tasks of a job, also as they come."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any

from lippmann.client import Client
from lippmann.client.errors import Refused
from lippmann.errors import JobEnded
from lippmann.job.messages.orders import TaskKind, TileIndex
from lippmann.job.states import ENDED_JOBS, TaskStatus
from service.schemas.events import EventTopic
from service.schemas.task import Task

_ATTEMPT_ENDED = frozenset({TaskStatus.READY, TaskStatus.DONE, TaskStatus.FAILED, TaskStatus.CANCELLED})
"""The statuses of a task whose latest attempt has ended; a task that is ready again is one that failed."""
_ATTEMPT_RUNS = frozenset({TaskStatus.DISPATCHED, TaskStatus.RUNNING})
"""The statuses of a task whose latest attempt has no whole log yet; the one before it may have one."""


@dataclass(frozen=True)
class TaskLog:
    """The log of the latest attempt of a task."""

    task: str
    """The id of the task."""
    kind: TaskKind
    status: TaskStatus
    frame: int | None
    tile: TileIndex | None
    output: str | None
    attempt: int
    log: str


def read_logs(
    client: Client, job_id: str, *, status: str | None = None, task_id: str | None = None, limit: int | None = None
) -> Iterator[TaskLog]:
    """Yield the logs of the tasks of a job in order, each of the latest attempt that has ended.

    Parameters
    ----------
    status
        Only the tasks with this status.
    task_id
        Only this task.
    limit
        The largest number of logs.

    Raises
    ------
    lippmann.client.Refused
        If there is no such job or task.
    """
    tasks = client.tasks(job_id, status=status) if task_id is None else iter([client.task(job_id, task_id)])
    found = (log for task in tasks if (log := _log_of(client, job_id, task)) is not None)
    yield from itertools.islice(found, limit)


def follow_logs(
    client: Client, job_id: str, *, status: str | None = None, task_id: str | None = None
) -> Iterator[TaskLog]:
    """Yield the logs that there are, and then each further one when its attempt has ended, until the job ends.

    Raises
    ------
    JobEnded
        If the job is removed meanwhile.
    """
    seen: set[tuple[str, int]] = set()

    def new(logs: Iterable[TaskLog | None]) -> Iterator[TaskLog]:
        for one in logs:
            if one is not None and (one.task, one.attempt) not in seen:
                seen.add((one.task, one.attempt))
                yield one

    is_first = True
    for event in client.events(job_id):  # The first event is the present state of the job.
        kind = event.type
        is_over = kind == EventTopic.JOB and event.data.get("status") in ENDED_JOBS
        if kind == EventTopic.JOB and event.data.get("removed"):
            raise JobEnded(f"job {job_id} was removed")
        if is_first or is_over or kind == EventTopic.RESET:
            yield from new(read_logs(client, job_id, status=status, task_id=task_id))
        elif kind == EventTopic.TASK and _is_wanted(event.data, status=status, task_id=task_id):
            yield from new([_log_of(client, job_id, client.task(job_id, event.data["id"]))])
        if is_over:
            return
        is_first = False


def _is_wanted(change: Mapping[str, Any], *, status: str | None, task_id: str | None) -> bool:
    return (
        change.get("status") in _ATTEMPT_ENDED
        and status in (None, change["status"])
        and task_id in (None, change.get("id"))
    )


def _log_of(client: Client, job_id: str, task: Task) -> TaskLog | None:
    """Return the log of a task; None for a task without a log."""
    attempt = task.attempt_number - (task.status in _ATTEMPT_RUNS)
    if attempt == 0:
        return None
    try:
        text = client.log(job_id, task.id, attempt=attempt)
    except Refused as error:
        if error.status == HTTPStatus.NOT_FOUND:
            return None
        raise
    return TaskLog(
        task=task.id,
        kind=task.kind,
        status=task.status,
        frame=task.frame,
        tile=task.tile,
        output=task.output,
        attempt=attempt,
        log=text,
    )
