"""The statuses of jobs and tasks, and the moves between them: one table for code, docs and tests."""

from __future__ import annotations

from enum import StrEnum
from types import MappingProxyType


class JobStatus(StrEnum):
    """Where a job stands."""

    QUEUED = "queued"
    PROBING = "probing"
    RUNNING = "running"
    PAUSED = "paused"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


class TaskStatus(StrEnum):
    """Where a task stands."""

    WAITING = "waiting"
    READY = "ready"
    DISPATCHED = "dispatched"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


_J, _T = JobStatus, TaskStatus

JOB_MOVES = MappingProxyType(
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
"""What a job of each status may become. Ended jobs move only by retry."""

TASK_MOVES = MappingProxyType(
    {
        _T.WAITING: frozenset({_T.READY, _T.CANCELLED}),
        _T.READY: frozenset({_T.DISPATCHED, _T.CANCELLED}),
        _T.DISPATCHED: frozenset({_T.RUNNING, _T.READY, _T.CANCELLED}),
        _T.RUNNING: frozenset({_T.DONE, _T.FAILED, _T.READY, _T.CANCELLED}),
        _T.DONE: frozenset({_T.READY}),
        _T.FAILED: frozenset({_T.READY, _T.WAITING}),
        _T.CANCELLED: frozenset({_T.READY, _T.WAITING}),
    }
)
"""What a task of each status may become. Ended tasks move only by retry."""

ENDED_JOBS = frozenset({_J.DONE, _J.FAILED, _J.CANCELLED})
ENDED_TASKS = frozenset({_T.DONE, _T.FAILED, _T.CANCELLED})
HELD_TASKS = frozenset({_T.DISPATCHED, _T.RUNNING})
"""Tasks that an attempt owns."""
