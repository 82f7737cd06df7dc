"""Background jobs: work on the rows of a job in chunks. Each round does one chunk per job, so that no job waits long.

A background job that fails is logged and tried again after a growing pause. Other jobs and all orders go on.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import structlog
from sqlalchemy.exc import OperationalError

from lippmann.job.messages.events import Presence
from lippmann.job.states import JobStatus
from lippmann.logs import trace_of
from lippmann.plan.artifact_store import ArtifactStore
from lippmann.telemetry import context_of_job, span
from service.db import jobs as job_rows
from service.db.engine import Database
from service.db.tables import BackgroundJob, Job
from service.errors import NotLeading
from service.jobs.commands import cancel_chunk, remove_chunk, retry_chunk
from service.jobs.completion import fail_job
from service.jobs.planner import Capacity, Planner
from service.jobs.state_machine import set_job
from service.settings import Settings

FIRST_PAUSE_S = 1.0
LONGEST_PAUSE_S = 60.0
ON_ROWS = frozenset({BackgroundJob.PLAN, BackgroundJob.CANCEL, BackgroundJob.RETRY})
"""The background jobs of the scheduler's thread, which takes a moment for a chunk of them."""
ON_ARTIFACTS = frozenset({BackgroundJob.REMOVE})
"""Those that delete all artifacts of a job; `service.coordinator.artifact_repairer` has those that read artifacts."""
UNPLANNABLE = "unplannable"

log = structlog.get_logger("service.background_jobs")


@dataclass(frozen=True)
class Backoff:
    """The number of consecutive failures of a background job, and the time of the last one."""

    failures: int
    failed_s: float

    def is_over(self, now_s: float) -> bool:
        """Return whether the job may be tried again; a clock that was set back prolongs no pause."""
        pause_s = min(LONGEST_PAUSE_S, FIRST_PAUSE_S * 2.0 ** min(self.failures - 1, 10))
        return not 0 <= now_s - self.failed_s < pause_s


class BackgroundJobs:
    """Runs the background jobs of some kinds, for all jobs."""

    def __init__(
        self, database: Database, store: ArtifactStore, settings: Settings,
        *, kinds: Collection[BackgroundJob],
    ) -> None:  # fmt: skip
        self._database = database
        self._store = store
        self._settings = settings
        self._kinds = kinds
        self._planner = Planner(database, store, settings)
        self._backoffs: dict[str, Backoff] = {}

    def run_round(self, *, slots: int = 0, workers: int = 0, fleet: Sequence[Presence] = (), now_s: float) -> bool:
        """Run one chunk of every background job; return whether there is more that is not paused.

        Parameters
        ----------
        slots, workers, fleet
            The workers for which jobs are planned; see `service.jobs.planner.Capacity`.
        """
        with self._database.reading() as session:
            pending = job_rows.background_jobs(session, self._kinds)
        self._backoffs = {job_id: self._backoffs[job_id] for job_id, _ in pending if job_id in self._backoffs}
        more = False
        for job_id, kind in pending:
            backoff = self._backoffs.get(job_id)
            if backoff is None or backoff.is_over(now_s):
                more |= self._try(job_id, kind, Capacity(slots, workers, fleet), now_s)
        return more

    def _try(self, job_id: str, kind: BackgroundJob, capacity: Capacity, now_s: float) -> bool:
        try:
            more = self._run_chunk(job_id, kind, capacity, now_s)
        except (OperationalError, NotLeading):
            raise  # the database is unavailable, or another process leads, which is no fault of the job
        except Exception as error:  # the failure of one job must not stop the orders of the others
            if kind is BackgroundJob.PLAN and isinstance(error, (ValueError, ArithmeticError)):
                self._give_up(job_id, error, now_s)
            return self._back_off(job_id, kind, error, now_s)
        self._backoffs.pop(job_id, None)
        return more

    def _back_off(self, job_id: str, kind: BackgroundJob, error: Exception, now_s: float) -> bool:
        failures = self._backoffs[job_id].failures + 1 if job_id in self._backoffs else 1
        self._backoffs[job_id] = Backoff(failures, now_s)
        trace = trace_of(error) if failures == 1 else ""
        log.warning(
            "a background job failed",
            job=job_id,
            background_job=kind,
            failures=failures,
            error=repr(error),
            trace=trace,
        )
        return False

    def _give_up(self, job_id: str, error: Exception, now_s: float) -> None:
        """Fail a job that cannot be planned: the next attempt would fail with the same numbers."""
        log.warning("a job cannot be planned", job=job_id, trace=trace_of(error))
        with self._database.writing() as session:
            row = session.get(Job, job_id)
            if row is None or row.background_job is not BackgroundJob.PLAN:
                return
            if row.status in (JobStatus.PROBING, JobStatus.RUNNING):
                set_job(session, row, background_job=None)
                fail_job(session, row, UNPLANNABLE, f"the job cannot be planned: {error}", now_s=now_s)

    def _run_chunk(self, job_id: str, kind: BackgroundJob, capacity: Capacity, now_s: float) -> bool:
        if kind is BackgroundJob.PLAN:
            with span("plan", parent=context_of_job(job_id), job=job_id):
                return self._planner.plan_chunk(job_id, capacity, now_s=now_s)
        if kind is BackgroundJob.REMOVE:
            return remove_chunk(self._database, self._store, job_id)
        with self._database.writing() as session:
            row = session.get(Job, job_id)
            if row is None or row.background_job is not kind:
                return True
            if kind is BackgroundJob.CANCEL:
                return cancel_chunk(session, row, now_s=now_s)
            return retry_chunk(session, row, now_s=now_s, limit=self._settings.failure_limit)
