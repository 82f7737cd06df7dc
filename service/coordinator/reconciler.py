"""The reconciler repairs rows, at start and every few seconds, so that nothing depends on an event arriving."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import structlog
from sqlalchemy.exc import OperationalError

from lippmann.job.messages.events import LOST, Failure, Presence
from lippmann.job.messages.orders import requirement_of
from lippmann.job.states import TaskStatus
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore
from service.claiming import fitting, is_able, not_able
from service.coordinator.batch_writer import close_jobs, write_batch
from service.coordinator.event_rules import Batch, fail, finish, hold
from service.coordinator.retry_policy import longest_pause_s
from service.db import access as access_rows
from service.db import coordinator as coordinator_rows
from service.db import events as event_rows
from service.db import faults as fault_rows
from service.db import jobs as job_rows
from service.db import task_sets
from service.db import tasks as task_rows
from service.db.counters import miscounted, recount
from service.db.engine import Database
from service.db.task_state import HeldAttempt
from service.errors import NotLeading
from service.instruments import Outcome, count_attempts
from service.jobs.completion import has_ended, settle
from service.jobs.state_machine import transition_tasks
from service.jobs.task_draft import TaskDraft
from service.settings import Settings

T = TypeVar("T")
PRUNE_ROUNDS = 20
MAX_JOBS = 500
"""The largest number of jobs that one run examines; the next runs examine the others in turn."""

log = structlog.get_logger("service.reconciler")


@dataclass(frozen=True)
class FarmView:
    """The state of the farm as the coordinator observes it now."""

    now_s: float
    slots: int
    is_live: bool
    """True while every event is read; False while the broker is unavailable or events wait to be read."""
    workers: tuple[Presence, ...] | None = None
    """The workers that take orders; None if only the number of their slots is known."""

    def has_free_slot(self, requirement: str) -> bool:
        """Return whether a worker that meets a requirement has a free slot, or no worker meets it."""
        able = [worker for worker in fitting(self.workers or (), requirement) if is_able(worker)]
        return not able or any(worker.holds is None or len(worker.holds) < worker.slots for worker in able)


@dataclass
class Reconciler:
    """Repairs rows, and remembers the position at which the last run stopped."""

    database: Database
    store: ArtifactStore
    settings: Settings
    _last_s: float | None = None
    _reached: dict[str, int] = field(default_factory=dict)
    _reached_job: str = ""
    _free_s: dict[str, float] = field(default_factory=dict)

    def start(self) -> int:
        """Recount the tasks of every open job, and return the number of jobs whose counters were wrong."""
        with self.database.reading() as session:
            job_ids = miscounted(session, job_rows.OPEN)
        wrong = 0
        for job_id in job_ids:
            with self.database.writing() as session:
                wrong += recount(session, job_id)
        return wrong

    def end_long_pauses(self, *, now_s: float) -> int:
        """End the pauses of tasks that last longer than any rule asks for, because the clock was set back.

        Return the number of these tasks. Jobs also avoid workers no longer than a rule asks for.
        """
        latest_s = now_s + longest_pause_s(self.settings)
        with self.database.writing() as session:
            fault_rows.end_avoidance(session, latest_s=latest_s)
            return task_rows.end_pauses(session, latest_s=latest_s)

    def shorten_pauses(self, *, by_s: float, now_s: float) -> int:
        """Shorten the pauses of tasks, and the times for which jobs avoid workers, after the clock was set back.

        Return the number of these tasks. A pause that began since then becomes shorter than it should be.
        """
        with self.database.writing() as session:
            fault_rows.shorten_avoidance(session, by_s=by_s, now_s=now_s)
            return task_rows.shorten_pauses(session, by_s=by_s, now_s=now_s)

    def run(self, view: FarmView) -> None:
        """Repair all rows that are wrong."""
        with self.database.reading() as session:
            held = task_rows.held(session, job_rows.busy_ids(session))
            requirements = job_rows.requirements_of_busy(session)
        asked = {task.attempt: requirement_of(requirements.get(task.job_id, ""), task.kind) for task in held}
        free_s = self._tick_free(view, set(asked.values()))
        idle_s = self._tick_idle(view, held)
        is_free = {requirement: seconds >= self.settings.unclaimed_s for requirement, seconds in free_s.items()}
        unclaimed = [task for task in held if self._is_unclaimed(task, idle_s) and is_free[asked[task.attempt]]]
        self.take_back(unclaimed, now_s=view.now_s)
        self._each(self._next_jobs(), lambda job_id: self._repair_job(job_id, view.now_s))
        self._delete_expired(view.now_s)

    def take_back_all(self, *, sent_until_s: float, now_s: float) -> int:
        """Take back the orders that were sent until a time to a broker that was wiped since; return their number."""
        with self.database.reading() as session:
            held = task_rows.held(session, job_rows.busy_ids(session))
        dispatched = (task for task in held if task.status is TaskStatus.DISPATCHED)
        orders = [task for task in dispatched if (task.dispatched_s or 0.0) <= sent_until_s]
        with self.database.writing() as session:
            coordinator_rows.reset_position(session)
        self.take_back(orders, now_s=now_s)
        return len(orders)

    def take_back(self, tasks: Iterable[HeldAttempt], *, now_s: float) -> None:
        """Take back orders that no worker claims: a task is done if its artifact exists, and ready otherwise."""
        self._each(tasks, lambda task: self._end(task, None, now_s))

    def give_up(self, lost: Iterable[tuple[HeldAttempt, str]], *, now_s: float) -> None:
        """Take tasks from lost attempts, with reasons: a task is done if its artifact exists, and failed otherwise."""

        def end(loss: tuple[HeldAttempt, str]) -> None:
            self._end(loss[0], Failure(code=LOST, message=loss[1], permanent=False), now_s)

        self._each(lost, end)

    def _each(self, items: Iterable[T], repair: Callable[[T], None]) -> None:
        """Repair each item; one that fails, for example because its folder cannot be read, does not stop the others."""
        errors = []
        for item in items:
            try:
                repair(item)
            except (OperationalError, NotLeading):
                raise  # the database is unavailable, or another process leads, which is no fault of the rows
            except Exception as error:  # one row must not prevent the others; logged together below
                errors.append(error)
        if errors:
            log.warning("rows could not be repaired", rows=len(errors), first=repr(errors[0]))

    def _end(self, seen: HeldAttempt, failure: Failure | None, now_s: float) -> None:
        # The store may be slow, so it is queried before the transaction; the fence detects a change in between.
        exists = bool(seen.artifact) and self.store.exists(names.job_artifact(seen.job_id, seen.artifact))
        with self.database.writing() as session:
            task = task_sets.states(session, [(seen.job_id, seen.sequence)]).get((seen.job_id, seen.sequence))
            if task is None or (task.attempt, task.status) != (seen.attempt, seen.status):
                return
            batch = Batch(now_s, self.settings, {task.key: TaskDraft(task)}, stops=[task.attempt])
            _end(batch, batch.drafts[task.key], failure, exists=exists)
            write_batch(session, batch)
            close_jobs(session, batch.touched, now_s=now_s, settings=self.settings)
        count_attempts(batch.outcomes)

    def _tick_free(self, view: FarmView, requirements: set[str]) -> dict[str, float]:
        """Return for how long the workers that meet each requirement have had a free slot in every run.

        Orders of a requirement may wait rightly while slots of other workers are free.
        """
        if view.workers is None:
            return dict.fromkeys(requirements, math.inf)
        passed_s = 0.0 if self._last_s is None else max(0.0, view.now_s - self._last_s)
        free = [requirement for requirement in requirements if view.has_free_slot(requirement)]
        self._free_s = {requirement: self._free_s.get(requirement, 0.0) + passed_s for requirement in free}
        return {requirement: self._free_s.get(requirement, 0.0) for requirement in requirements}

    def _tick_idle(self, view: FarmView, held: Sequence[HeldAttempt]) -> float:
        """Advance the idle clock by the time since the last run, if some slot that counts was free."""
        passed_s = 0.0 if self._last_s is None else view.now_s - self._last_s
        self._last_s = view.now_s
        closed = {*not_able(view.workers or ())}
        running = sum(task.status is TaskStatus.RUNNING and task.worker not in closed for task in held)
        is_free = view.is_live and running < view.slots
        # Time in which this process slept proves nothing about the slots.
        counted_s = min(max(0.0, passed_s), 3 * self.settings.reconcile_s) if is_free else 0.0
        if counted_s == 0.0:
            with self.database.reading() as session:
                return coordinator_rows.current(session).idle_s
        with self.database.writing() as session:
            return coordinator_rows.add_idle(session, counted_s)

    def _is_unclaimed(self, task: HeldAttempt, idle_s: float) -> bool:
        if task.status is not TaskStatus.DISPATCHED:
            return False
        return idle_s - (task.dispatched_idle_s or 0.0) > self.settings.unclaimed_s

    def _next_jobs(self) -> Sequence[str]:
        """Return the next jobs to examine, in turn."""
        with self.database.reading() as session:
            job_ids = job_rows.to_reconcile(session, after=self._reached_job, limit=MAX_JOBS)
        self._reached_job = job_ids[-1] if len(job_ids) == MAX_JOBS else ""
        return job_ids

    def _repair_job(self, job_id: str, now_s: float) -> None:
        """Examine the next chunk of a job's waiting tasks, and whether the job has ended; write only corrections."""
        limit = self.settings.failure_limit
        with self.database.reading() as session:
            free, reached = task_rows.overdue(session, job_id, after=self._reached.get(job_id, -1))
            row = job_rows.job(session, job_id)
            is_right = not free and (row is None or not has_ended(session, row, limit=limit))
        self._reached.pop(job_id, None)
        if reached is not None:
            self._reached[job_id] = reached
        if is_right:
            return
        with self.database.writing() as session:
            row = job_rows.job(session, job_id)
            if row is None or row.background_job is not None:
                return
            transition_tasks(session, job_id, free, TaskStatus.WAITING, TaskStatus.READY)
            close_jobs(session, {job_id} if free else set(), now_s=now_s, settings=self.settings)
            session.refresh(row)
            settle(session, row, now_s=now_s, limit=limit)

    def _delete_expired(self, now_s: float) -> None:
        with self.database.writing() as session:
            access_rows.delete_expired(
                session,
                now_s=now_s,
                idle_s=self.settings.session_idle_s,
                idempotency_s=self.settings.idempotency_s,
                audit_s=self.settings.audit_days * 86_400,
            )
        for _ in range(PRUNE_ROUNDS):
            with self.database.writing() as session:
                if not event_rows.prune(session, kept=self.settings.events_kept, limit=task_rows.CHUNK):
                    return


def _end(batch: Batch, draft: TaskDraft, failure: Failure | None, *, exists: bool) -> None:
    """End an attempt without its final event: the task is done if its artifact exists."""
    task = draft.now
    if exists:
        hold(draft, task.worker, task.instance, now_s=batch.now_s)
        batch.outcomes[Outcome.DONE] += 1
        finish(draft, cpu_s=None, wall_s=None, now_s=batch.now_s)
    elif failure is None:
        draft.transition(TaskStatus.READY)
    else:
        fail(batch, draft, failure, worker=task.worker)
