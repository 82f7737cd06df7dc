"""The consequences of the events of workers, on plain values. Pure: neither a database nor a broker is needed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from lippmann.digest import Digest
from lippmann.job.messages.events import Event, EventKind, Failure, ProbeResult
from lippmann.job.messages.orders import TaskKind
from lippmann.job.messages.worker_keys import key_of_instance
from lippmann.job.states import HELD_TASKS, TaskStatus
from service.coordinator.retry_policy import Fault, fail_attempt, outcome_of
from service.db.task_state import TaskKey, TaskState
from service.errors import NotFound
from service.ids import parse_task_id
from service.instruments import Outcome
from service.jobs.task_draft import TaskDraft
from service.settings import Settings

NO_PROBE = Failure(code="probe-empty", message="the probe ended without a measurement", permanent=False)
NO_REASON = Failure(code="unknown", message="the worker gave no reason", permanent=False)

NO_ERROR = dict.fromkeys(("error_code", "error_message", "error_frame", "error_artifact"))
"""The columns of the last error of a task that is done."""

MOST_BYTES = 10**13
"""The largest size of the artifacts of a task that is counted, which keeps sums finite."""

_AFTER = {
    EventKind.FAILED: (TaskStatus.READY, TaskStatus.WAITING, TaskStatus.FAILED),
    EventKind.DECLINED: (TaskStatus.READY,),
}
"""The statuses of a task after an event. An event that finds them, from the same attempt, is a repetition."""
WORKING = frozenset({EventKind.CLAIMED, EventKind.HEARTBEAT})
"""The events of an attempt that works. No order follows from them, but a stop of an attempt that owns no task."""


@dataclass
class Batch:
    """What one transaction changes: tasks, and what follows for their jobs, their attempts and their workers."""

    now_s: float
    settings: Settings
    drafts: dict[TaskKey, TaskDraft] = field(default_factory=dict)
    late: Counter[str] = field(default_factory=Counter)
    """The number of events, by job, of attempts that do not own their tasks."""
    stops: list[str | None] = field(default_factory=list)
    """The attempts that must stop."""
    faults: list[Fault] = field(default_factory=list)
    probes: dict[str, ProbeResult] = field(default_factory=dict)
    """The measurements of probes, by job."""
    outcomes: Counter[Outcome] = field(default_factory=Counter)
    """The attempts that ended, by how they did."""

    @property
    def suspicious(self) -> set[str]:
        """The jobs with a task that waits because it could not read an artifact."""
        return {draft.now.job_id for draft in self.drafts.values() if draft.is_newly(TaskStatus.WAITING)}

    @property
    def touched(self) -> set[str]:
        """The jobs whose tasks change."""
        return {draft.now.job_id for draft in self.drafts.values() if draft.values}


def fold_events(
    states: Mapping[TaskKey, TaskState], events: Iterable[Event], *, now_s: float, settings: Settings
) -> Batch:
    """Apply events in their order to the tasks that they name, and return all changes."""
    batch = Batch(now_s, settings, {key: TaskDraft(state) for key, state in states.items()})
    for event in events:
        apply_event(batch, event)
    return batch


def apply_event(batch: Batch, event: Event) -> None:
    """Apply one event, if its attempt owns its task."""
    key = task_key(event)
    draft = batch.drafts.get(key) if key is not None else None
    if draft is None or draft.now.attempt != event.attempt or draft.now.status not in HELD_TASKS:
        _count_late(batch, draft, event)
    elif not _is_of_holder(draft.now, event):
        # No stop is requested, because it would stop the worker that holds the attempt.
        batch.late[draft.now.job_id] += 1
    else:
        _APPLY[event.kind](batch, draft, event)


def task_key(event: Event) -> TaskKey | None:
    """Return the key of the task that an event names; None if no task can have this name."""
    try:
        job_id, sequence = parse_task_id(event.task_id)
    except NotFound:
        return None
    return (job_id, sequence) if job_id == event.job_id else None


def hold(draft: TaskDraft, worker: str | None, instance: str | None, *, now_s: float) -> None:
    """Apply that an attempt of a worker process owns its task."""
    if draft.now.status is TaskStatus.DISPATCHED:
        draft.transition(TaskStatus.RUNNING, worker=worker, instance=instance, claimed_s=now_s, heartbeat_s=now_s)


def finish(
    draft: TaskDraft,
    *,
    cpu_s: float | None,
    wall_s: float | None,
    now_s: float,
    digests: Mapping[str, Digest] | None = None,
    cached: bool = False,
) -> None:
    """Apply that a task is done."""
    values = {"cpu_s": cpu_s, "wall_s": wall_s, "progress": 1.0, "ended_s": now_s, "digests": digests or None}
    values |= {"cached": cached}
    if digests:
        values["stored_bytes"] = min(sum(digest.size for digest in digests.values()), MOST_BYTES)
    draft.transition(TaskStatus.DONE, **values, **NO_ERROR)


def fail(batch: Batch, draft: TaskDraft, failure: Failure, *, worker: str | None) -> None:
    """Apply that an attempt failed."""
    batch.outcomes[outcome_of(failure)] += 1
    fault = fail_attempt(draft, failure, worker=worker, now_s=batch.now_s, settings=batch.settings)
    if fault is not None:
        batch.faults.append(fault)


def without_old_heartbeats(events: Iterable[Event]) -> list[Event]:
    """Return events without the heartbeats that a later one of the same attempt follows."""
    # With 2,000 slots most events are heartbeats.
    kept = list(events)
    last = {event.attempt: i for i, event in enumerate(kept) if event.kind is EventKind.HEARTBEAT}
    return [event for i, event in enumerate(kept) if event.kind is not EventKind.HEARTBEAT or last[event.attempt] == i]


def _hold(batch: Batch, draft: TaskDraft, event: Event) -> None:
    hold(draft, event.worker, event.instance, now_s=batch.now_s)


def _heartbeat(batch: Batch, draft: TaskDraft, event: Event) -> None:
    _hold(batch, draft, event)
    progress = draft.now.progress if event.progress is None else event.progress
    draft.set(heartbeat_s=batch.now_s, progress=progress)


def _done(batch: Batch, draft: TaskDraft, event: Event) -> None:
    _hold(batch, draft, event)
    if draft.now.kind is TaskKind.PROBE:
        if event.probe is None:
            fail(batch, draft, NO_PROBE, worker=event.worker)
            return
        batch.probes[draft.now.job_id] = event.probe
    batch.outcomes[Outcome.DONE] += 1
    cached = event.cached and draft.now.kind is TaskKind.RENDER
    finish(draft, cpu_s=event.cpu_s, wall_s=event.wall_s, now_s=batch.now_s, digests=event.digests, cached=cached)


def _failed(batch: Batch, draft: TaskDraft, event: Event) -> None:
    _hold(batch, draft, event)
    fail(batch, draft, event.failure or NO_REASON, worker=event.worker)


def _declined(batch: Batch, draft: TaskDraft, _event: Event) -> None:
    batch.outcomes[Outcome.DECLINED] += 1
    due_s = batch.now_s + batch.settings.decline_pause_s
    draft.transition(TaskStatus.READY, progress=None, not_before_s=due_s)


_APPLY: Mapping[EventKind, Callable[[Batch, TaskDraft, Event], None]] = {
    EventKind.CLAIMED: _hold,
    EventKind.HEARTBEAT: _heartbeat,
    EventKind.DONE: _done,
    EventKind.FAILED: _failed,
    EventKind.DECLINED: _declined,
}


def _is_of_holder(task: TaskState, event: Event) -> bool:
    """Return whether an event is of the worker process that claimed the attempt, if one has claimed it."""
    if task.worker is None:
        return True
    is_older = None in (task.instance, event.instance) and key_of_instance(task.instance) is None
    is_same_process = is_older or task.instance == event.instance
    return task.worker == event.worker and is_same_process


def _count_late(batch: Batch, draft: TaskDraft | None, event: Event) -> None:
    if draft is not None and _is_repetition(draft.now, event):
        return
    if draft is not None:
        batch.late[draft.now.job_id] += 1
    if event.kind in WORKING:
        # A stop was requested earlier, and the broker may have lost the signal.
        batch.stops.append(event.attempt)


def _is_repetition(task: TaskState, event: Event) -> bool:
    # Once this attempt has done the task, its further events are repetitions, in whichever order they arrive.
    if task.attempt != event.attempt:
        return False
    return task.status is TaskStatus.DONE or task.status in _AFTER.get(event.kind, ())
