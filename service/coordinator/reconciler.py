"""The rows are made right, at start and every few seconds. Nothing depends on an event arriving."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import structlog
from sqlalchemy.exc import OperationalError

from lippmann.job.events import Failure
from lippmann.job.states import TaskStatus
from lippmann.plan import artifact_names as names
from service.coordinator.event_consumer import Batch, close_batch, finish_task, hold
from service.coordinator.retry_policy import LOST, fail_attempt
from service.db import access as access_rows
from service.db import coordinator as clerk_rows
from service.db import events as event_rows
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.counters import is_miscounted, move_task, move_tasks, recount
from service.db.engine import Database
from service.db.tables import Task
from service.events.publish import tell_task
from service.jobs.completion import has_ended, settle
from service.ports import ArtifactStore
from service.settings import Settings

T = TypeVar("T")
PRUNE_ROUNDS = 20
JOBS = 500
"""Jobs that one run looks at: with more, each has its turn in one of the next."""

log = structlog.get_logger("service.reconcile")


@dataclass(frozen=True)
class Sight:
    """What the clerk can see of the farm just now."""

    now_s: float
    slots: int
    listening_since_s: float | None
    """Since when every event has been heard without a gap; None while the broker is silent or events are behind."""


@dataclass
class Reconciler:
    """Makes rows right, and remembers where it left off."""

    database: Database
    store: ArtifactStore
    settings: Settings
    _last_s: float | None = None
    _reached: dict[str, int] = field(default_factory=dict)
    _reached_job: str = ""

    def start(self) -> int:
        """Count every open job's tasks again, and return how many rows were wrong."""
        with self.database.reading() as session:
            job_ids = [job_id for job_id in job_rows.open_ids(session) if is_miscounted(session, job_id)]
        wrong = 0
        for job_id in job_ids:
            with self.database.writing() as session:
                wrong += recount(session, job_id)
        return wrong

    def run(self, sight: Sight) -> None:
        """Make everything right that can be."""
        with self.database.reading() as session:
            held = task_rows.held(session, job_rows.busy_ids(session))
        idle_s = self._tick_idle(sight, held)
        unclaimed = [task for task in held if self._is_unclaimed(task, idle_s)]
        lost = [task for task in held if self._is_lost(task, sight)]
        self.send_back(unclaimed, now_s=sight.now_s)
        self.give_up(lost, now_s=sight.now_s)
        self._each(self._next_jobs(), lambda job_id: self._walk(job_id, sight.now_s))
        self._forget_old(sight.now_s)

    def broker_is_new(self, *, now_s: float) -> int:
        """Send back every order: a broker that was wiped has none of them; returns how many."""
        with self.database.reading() as session:
            orders = task_rows.held(session, job_rows.busy_ids(session), status=TaskStatus.DISPATCHED)
        with self.database.writing() as session:
            clerk_rows.rewind(session)
        self.send_back(orders, now_s=now_s)
        return len(orders)

    def send_back(self, tasks: Iterable[Task], *, now_s: float) -> None:
        """Take orders back that nobody claims: done if the artifact is there, ready otherwise."""
        self._each(tasks, lambda task: self._end(task, None, now_s))

    def give_up(self, tasks: Iterable[Task], *, now_s: float) -> None:
        """Take tasks from silent attempts: done if the artifact is there, otherwise a failure of the task."""

        def end(task: Task) -> None:
            said = f"worker {task.worker} went silent"
            self._end(task, Failure(code=LOST, message=said, permanent=False), now_s)

        self._each(tasks, end)

    def _each(self, items: Iterable[T], make_right: Callable[[T], None]) -> None:
        """Make each right; one that cannot be, as its folder cannot be read, keeps no other from it."""
        errors = []
        for item in items:
            try:
                make_right(item)
            except OperationalError:
                raise  # the database is away, which is no job's fault
            except Exception as error:  # one row's trouble must not hide the others'; said together below
                errors.append(error)
        if errors:
            log.warning("rows could not be made right", rows=len(errors), first=repr(errors[0]))

    def _end(self, seen: Task, failure: Failure | None, now_s: float) -> None:
        # The store may be slow, so it is asked before the transaction; the attempt's fence holds what was seen.
        is_there = bool(seen.artifact) and self.store.exists(names.job_artifact(seen.job_id, seen.artifact))
        with self.database.writing() as session:
            task = task_rows.task(session, seen.job_id, seen.sequence)
            if task is None or (task.attempt, task.status) != (seen.attempt, seen.status):
                return
            batch = Batch(session, now_s, self.settings, {task.job_id})
            clerk_rows.stop(session, [task.attempt], now_s=now_s)
            if is_there:
                hold(batch, task, task.worker)
                finish_task(batch, task, cpu_s=None, wall_s=None)
            elif failure is None:
                move_task(session, task, TaskStatus.READY)
            else:
                fail_attempt(session, task, failure, worker=task.worker, now_s=now_s, settings=self.settings)
            tell_task(session, task)
            close_batch(batch)

    def _tick_idle(self, sight: Sight, held: Sequence[Task]) -> float:
        """Advance the idle clock by what has passed, if some slot was free."""
        passed_s = 0.0 if self._last_s is None else sight.now_s - self._last_s
        self._last_s = sight.now_s
        running = sum(task.status is TaskStatus.RUNNING for task in held)
        is_free = sight.listening_since_s is not None and running < sight.slots
        # Time in which this clerk slept proves nothing about the slots.
        counted_s = min(max(0.0, passed_s), 3 * self.settings.reconcile_s) if is_free else 0.0
        if counted_s == 0.0:
            with self.database.reading() as session:
                return clerk_rows.clerk(session).idle_s
        with self.database.writing() as session:
            return clerk_rows.add_idle(session, counted_s)

    def _is_unclaimed(self, task: Task, idle_s: float) -> bool:
        if task.status is not TaskStatus.DISPATCHED:
            return False
        return idle_s - (task.dispatched_idle_s or 0.0) > self.settings.unclaimed_s

    def _is_lost(self, task: Task, sight: Sight) -> bool:
        # Silence counts only while someone listened: an outage of the broker silences every attempt.
        if task.status is not TaskStatus.RUNNING or sight.listening_since_s is None:
            return False
        beat_s = task.beat_s or 0.0
        if beat_s > sight.now_s + self.settings.lease_ttl_s:  # written before the clock was set back
            beat_s = 0.0
        heard_s = max(beat_s, sight.listening_since_s)
        return sight.now_s - heard_s > self.settings.lease_ttl_s

    def _next_jobs(self) -> Sequence[str]:
        """Return the next jobs to look at; all have their turn."""
        with self.database.reading() as session:
            job_ids = job_rows.restless(session, after=self._reached_job, limit=JOBS)
        self._reached_job = job_ids[-1] if len(job_ids) == JOBS else ""
        return job_ids

    def _walk(self, job_id: str, now_s: float) -> None:
        """Look at the next chunk of a job's waiting tasks, and whether the job has ended; write only what is wrong."""
        share = self.settings.failed_share
        with self.database.reading() as session:
            free, reached = task_rows.overdue(session, job_id, after=self._reached.get(job_id, -1))
            row = job_rows.job(session, job_id)
            is_right = not free and (row is None or not has_ended(session, row, failed_share=share))
        self._reached.pop(job_id, None)
        if reached is not None:
            self._reached[job_id] = reached
        if is_right:
            return
        with self.database.writing() as session:
            row = job_rows.job(session, job_id)
            if row is None or row.chore is not None:
                return
            move_tasks(session, job_id, free, TaskStatus.WAITING, TaskStatus.READY)
            close_batch(Batch(session, now_s, self.settings, {job_id} if free else set()))
            session.refresh(row)
            settle(session, row, now_s=now_s, failed_share=share)

    def _forget_old(self, now_s: float) -> None:
        with self.database.writing() as session:
            access_rows.forget_old(session, now_s=now_s, idempotency_s=self.settings.idempotency_s)
        for _ in range(PRUNE_ROUNDS):
            with self.database.writing() as session:
                if not event_rows.prune(session, kept=self.settings.events_kept, limit=task_rows.CHUNK):
                    return
