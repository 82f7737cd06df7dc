"""Work on rows in pieces: one piece of every job's chore a round, so that nobody waits for a long one.

A chore that fails is said and rests, longer each time; the chores of other jobs, and all orders, go on.
"""

from __future__ import annotations

from dataclasses import dataclass
from traceback import format_exception

import structlog
from sqlalchemy.exc import OperationalError

from lippmann.job.states import JobStatus
from service.db import jobs as job_rows
from service.db.engine import Database
from service.db.tables import Chore, Job
from service.jobs.cancel import cancel_some
from service.jobs.completion import fail_job
from service.jobs.planner import Planner
from service.jobs.remove import remove_some
from service.jobs.retry import retry_some
from service.jobs.state_machine import set_job
from service.ports import ArtifactStore
from service.settings import Settings

FIRST_REST_S = 1.0
LONGEST_REST_S = 60.0
UNPLANNABLE = "unplannable"

log = structlog.get_logger("service.chores")


@dataclass(frozen=True)
class Rest:
    """How often a job's chore has failed in a row, and when it did last."""

    failures: int
    from_s: float

    def is_over(self, now_s: float) -> bool:
        """Return whether it may be tried again; a clock that was set back makes nobody wait."""
        rest_s = min(LONGEST_REST_S, FIRST_REST_S * 2.0 ** min(self.failures - 1, 10))
        return not 0 <= now_s - self.from_s < rest_s


class Chores:
    """Does the chores of every job."""

    def __init__(self, database: Database, store: ArtifactStore, settings: Settings) -> None:
        self._database = database
        self._store = store
        self._settings = settings
        self._planner = Planner(database, store, settings)
        self._resting: dict[str, Rest] = {}

    def do_some(self, *, slots: int, now_s: float) -> bool:
        """Do one piece of every chore; True while there is more that does not rest."""
        with self._database.reading() as session:
            chores = job_rows.chores(session)
        self._resting = {job_id: self._resting[job_id] for job_id, _ in chores if job_id in self._resting}
        more = False
        for job_id, chore in chores:
            rest = self._resting.get(job_id)
            if rest is None or rest.is_over(now_s):
                more |= self._try(job_id, chore, slots, now_s)
        return more

    def _try(self, job_id: str, chore: Chore, slots: int, now_s: float) -> bool:
        try:
            more = self._do(job_id, chore, slots, now_s)
        except OperationalError:
            raise  # the database is away, which is no job's fault
        except Exception as error:  # one job's trouble must not keep the others' orders from going out
            if chore is Chore.PLAN and isinstance(error, (ValueError, ArithmeticError)):
                self._give_up(job_id, error, now_s)
            return self._rest(job_id, chore, error, now_s)
        self._resting.pop(job_id, None)
        return more

    def _rest(self, job_id: str, chore: Chore, error: Exception, now_s: float) -> bool:
        failures = self._resting[job_id].failures + 1 if job_id in self._resting else 1
        self._resting[job_id] = Rest(failures, now_s)
        trace = "".join(format_exception(error)) if failures == 1 else ""
        log.warning("a chore failed", job=job_id, chore=chore, failures=failures, error=repr(error), trace=trace)
        return False

    def _give_up(self, job_id: str, error: Exception, now_s: float) -> None:
        """End a job whose numbers cannot be planned: they would be the same each time."""
        log.warning("a job cannot be planned", job=job_id, trace="".join(format_exception(error)))
        with self._database.writing() as session:
            row = session.get(Job, job_id)
            if row is not None and row.chore is Chore.PLAN and row.status in (JobStatus.PROBING, JobStatus.RUNNING):
                set_job(session, row, chore=None)
                fail_job(session, row, UNPLANNABLE, f"the job cannot be planned: {error}", now_s=now_s)

    def _do(self, job_id: str, chore: Chore, slots: int, now_s: float) -> bool:
        if chore is Chore.PLAN:
            return self._planner.plan_some(job_id, slots=slots, now_s=now_s)
        if chore is Chore.REMOVE:
            return remove_some(self._database, self._store, job_id)
        with self._database.writing() as session:
            row = session.get(Job, job_id)
            if row is None or row.chore is not chore:
                return True
            if chore is Chore.CANCEL:
                return cancel_some(session, row, now_s=now_s)
            return retry_some(session, row, now_s=now_s, failed_share=self._settings.failed_share)
