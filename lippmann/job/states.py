"""The statuses of jobs, tasks and frames, the transitions between them, and what users may do with a job.

The service's guards, the API, the dashboard's buttons, `docs/statuses.md` and the tests read these tables.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

from lippmann.job.messages.orders import TaskKind


class JobStatus(StrEnum):
    """The status of a job."""

    QUEUED = "queued"
    PROBING = "probing"
    RUNNING = "running"
    PAUSED = "paused"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


class TaskStatus(StrEnum):
    """The status of a task."""

    WAITING = "waiting"
    READY = "ready"
    DISPATCHED = "dispatched"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"
    SKIPPED = "skipped"


class FrameStatus(StrEnum):
    """The status of a frame, which follows from its tasks.

    `waiting`: no task of the frame has begun, or the job ended without the frame. `rendering`: some of its tasks run or
    are done. `done`: its pictures are stored. `failed`: one of its tasks failed. `skipped`: a user left it out.
    """

    WAITING = "waiting"
    RENDERING = "rendering"
    DONE = "done"
    FAILED = "failed"
    SKIPPED = "skipped"


class PausedBy(StrEnum):
    """Who paused a job: a user, or the farm because a disk is full or something else prevents all work."""

    USER = "user"
    FARM = "farm"


class JobAction(StrEnum):
    """Something that a user may do with a job."""

    PAUSE = "pause"
    RESUME = "resume"
    CANCEL = "cancel"
    RETRY = "retry"
    REPAIR = "repair"
    SKIP = "skip"
    PRIORITISE = "prioritise"
    REMOVE = "remove"


@dataclass(frozen=True)
class ActionRule:
    """The statuses in which an action is allowed, and the status that it leads to."""

    allowed_in: frozenset[JobStatus]
    leads_to: JobStatus | None
    """None for an action that leaves the status as it is, or that removes the job."""


_J, _T = JobStatus, TaskStatus

JOB_TRANSITIONS = MappingProxyType(
    {
        _J.QUEUED: frozenset({_J.PROBING, _J.CANCELLED}),
        _J.PROBING: frozenset({_J.RUNNING, _J.FAILED, _J.PAUSED, _J.CANCELLED}),
        _J.RUNNING: frozenset({_J.PAUSED, _J.DONE, _J.FAILED, _J.CANCELLED}),
        _J.PAUSED: frozenset({_J.RUNNING, _J.CANCELLED}),
        _J.DONE: frozenset({_J.RUNNING}),
        _J.FAILED: frozenset({_J.RUNNING}),
        _J.CANCELLED: frozenset({_J.RUNNING}),
    }
)
"""The statuses that a job of each status may become. A job that has ended becomes another only by retry and
repair, and a done job also when a reader finds one of its artifacts damaged."""

TASK_TRANSITIONS = MappingProxyType(
    {
        _T.WAITING: frozenset({_T.READY, _T.FAILED, _T.CANCELLED, _T.SKIPPED}),
        _T.READY: frozenset({_T.DISPATCHED, _T.WAITING, _T.CANCELLED, _T.SKIPPED}),
        _T.DISPATCHED: frozenset({_T.RUNNING, _T.READY, _T.CANCELLED}),
        _T.RUNNING: frozenset({_T.DONE, _T.FAILED, _T.READY, _T.WAITING, _T.CANCELLED}),
        _T.DONE: frozenset({_T.READY}),
        _T.FAILED: frozenset({_T.READY, _T.WAITING, _T.SKIPPED}),
        _T.CANCELLED: frozenset({_T.READY, _T.WAITING, _T.SKIPPED}),
        _T.SKIPPED: frozenset({_T.READY, _T.WAITING}),
    }
)
"""The statuses that a task of each status may become. A task that has ended becomes another only by retry and skip of
its job; a done task becomes ready when one of its artifacts is missing or damaged, and the tasks that need it wait."""

ENDED_JOBS = frozenset({_J.DONE, _J.FAILED, _J.CANCELLED})
ENDED_TASKS = frozenset({_T.DONE, _T.FAILED, _T.CANCELLED, _T.SKIPPED})
SATISFIED_TASKS = frozenset({_T.DONE, _T.SKIPPED})
"""The statuses of a task on which no other task waits."""
HELD_TASKS = frozenset({_T.DISPATCHED, _T.RUNNING})
"""The statuses in which an attempt owns a task."""

JOB_ACTIONS = MappingProxyType(
    {
        JobAction.PAUSE: ActionRule(frozenset({_J.PROBING, _J.RUNNING}), _J.PAUSED),
        JobAction.RESUME: ActionRule(frozenset({_J.PAUSED}), _J.RUNNING),
        JobAction.CANCEL: ActionRule(frozenset({_J.QUEUED, _J.PROBING, _J.RUNNING, _J.PAUSED}), _J.CANCELLED),
        JobAction.RETRY: ActionRule(frozenset({_J.FAILED, _J.CANCELLED}), _J.RUNNING),
        JobAction.REPAIR: ActionRule(ENDED_JOBS, _J.RUNNING),
        JobAction.SKIP: ActionRule(frozenset({_J.FAILED, _J.CANCELLED}), _J.RUNNING),
        JobAction.PRIORITISE: ActionRule(frozenset(_J) - {_J.DONE}, None),
        JobAction.REMOVE: ActionRule(ENDED_JOBS, None),
    }
)
"""The rule of each action. A done job runs no more, so it has no priority to change."""


def actions_for(status: JobStatus, paused_by: PausedBy | None = None, *, skipped: int = 0) -> tuple[JobAction, ...]:
    """Return the actions that are allowed on a job of this status, with this number of skipped tasks.

    A job that the farm has paused goes on by itself, so a user may also pause it. A done job with skipped frames can be
    retried, which brings them back.

    >>> [str(action) for action in actions_for(JobStatus.PAUSED)]
    ['resume', 'cancel', 'prioritise']
    >>> JobAction.PAUSE in actions_for(JobStatus.PAUSED, PausedBy.FARM)
    True
    """
    allowed = {action for action, rule in JOB_ACTIONS.items() if status in rule.allowed_in}
    if paused_by is PausedBy.FARM and status is JobStatus.PAUSED:
        allowed.add(JobAction.PAUSE)
    if skipped and status is JobStatus.DONE:
        allowed.add(JobAction.RETRY)
    return tuple(action for action in JobAction if action in allowed)


def frame_status(tasks: Collection[tuple[TaskKind, TaskStatus]], job: JobStatus) -> FrameStatus:
    """Return the status of a frame from its tasks; no frame of a job that has ended is rendering.

    >>> str(frame_status({(TaskKind.RENDER, TaskStatus.DONE)}, JobStatus.RUNNING))
    'rendering'
    """
    statuses = {status for _, status in tasks}
    if (TaskKind.ASSEMBLE, TaskStatus.SKIPPED) in tasks:
        return FrameStatus.SKIPPED
    if (TaskKind.ASSEMBLE, TaskStatus.DONE) in tasks:
        return FrameStatus.DONE
    if TaskStatus.FAILED in statuses:
        return FrameStatus.FAILED
    begun = statuses & {TaskStatus.RUNNING, TaskStatus.DONE}
    return FrameStatus.RENDERING if begun and job not in ENDED_JOBS else FrameStatus.WAITING
