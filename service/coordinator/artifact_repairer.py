"""The artifact repairer verifies artifacts and takes back the tasks that made damaged ones.

It has a thread of its own, since it reads whole artifacts. Two background jobs are its work: `repair`, when an attempt
could not read an artifact, and `verify`, when a user asks for everything. Meanwhile no task of the job is dispatched.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import structlog
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from lippmann.errors import ArtifactBroken
from lippmann.job.states import TaskStatus
from lippmann.plan.artifact_store import ArtifactStore
from service.coordinator.retry_policy import doubled_pause_s
from service.db import jobs as job_rows
from service.db import task_sets
from service.db import tasks as task_rows
from service.db.engine import Database
from service.db.tables import BackgroundJob, Job, Task
from service.errors import NotLeading
from service.jobs.artifact_repair import CODES, REPAIRS_ALLOWED, damage_found_by, take_back_in_chunks
from service.jobs.completion import settle
from service.jobs.state_machine import set_job, write_drafts
from service.jobs.task_draft import TaskDraft
from service.jobs.verification import Finding, verify_tasks
from service.settings import Settings

KINDS = frozenset({BackgroundJob.REPAIR, BackgroundJob.VERIFY})
NO_ERROR = dict.fromkeys(("error_code", "error_message", "error_frame", "error_artifact"))

log = structlog.get_logger("service.artifact_repairer")


class ArtifactRepairer:
    """Repairs jobs, and remembers up to which task each of them is verified; a restart verifies from the beginning."""

    def __init__(self, database: Database, store: ArtifactStore, settings: Settings) -> None:
        self._database = database
        self._store = store
        self._settings = settings
        self._reached: dict[str, int] = {}

    def run_round(self, *, now_s: float) -> bool:
        """Do one chunk for every job that needs it; return whether anything was done."""
        with self._database.reading() as session:
            pending = job_rows.background_jobs(session, KINDS)
        self._reached = {job_id: self._reached[job_id] for job_id, _ in pending if job_id in self._reached}
        done = False
        for job_id, kind in pending:
            try:
                if kind is BackgroundJob.VERIFY:
                    self._verify_chunk(job_id)
                else:
                    self._repair_chunk(job_id, now_s)
                done = True
            except (OperationalError, NotLeading):
                raise  # the database is unavailable, or another process leads, which is no fault of the job
            except Exception as error:  # a store that does not answer is tried again in the next round
                log.warning("artifacts could not be verified", job=job_id, error=repr(error))
        return done

    def _verify_chunk(self, job_id: str) -> None:
        with self._database.reading() as session:
            row = session.get(Job, job_id)
            page = task_rows.done_page(session, job_id, after=self._reached.get(job_id, -1))
        if row is None:
            return
        found = list(verify_tasks(self._store, row.parsed_spec, page))
        if found:
            log.info("damaged artifacts are made again", job=job_id, count=len(found), first=found[0].message)
            self._take_back(job_id, found, during=BackgroundJob.VERIFY, by_itself=False)
        with self._database.writing() as session:
            row = session.get(Job, job_id)
            if row is None or row.background_job is not BackgroundJob.VERIFY:
                return
            if not page:
                set_job(session, row, background_job=BackgroundJob.RETRY)
        if page:
            self._reached[job_id] = page[-1].sequence

    def _repair_chunk(self, job_id: str, now_s: float) -> None:
        with self._database.reading() as session:
            row = session.get(Job, job_id)
            failed = task_rows.waiting_for_repair(session, job_id, CODES)
        if row is None:
            return
        spec = row.parsed_spec
        found = {task.sequence: list(damage_found_by(self._database, self._store, spec, [task])) for task in failed}
        twice = self._damaged_twice(job_id, found)
        again = {each: None for sequence, each_found in found.items() if sequence not in twice for each in each_found}
        if again:
            log.info("damaged artifacts are made again", job=job_id, count=len(again), first=next(iter(again)).message)
            self._take_back(job_id, list(again), during=BackgroundJob.REPAIR, by_itself=True)
        with self._database.writing() as session:
            row = session.get(Job, job_id)
            if row is None or row.background_job is not BackgroundJob.REPAIR:
                return
            for task in failed:
                self._repair(session, task, twice.get(task.sequence), now_s)
            if len(failed) < task_rows.FRAMES_A_PAGE:
                set_job(session, row, background_job=None)
            settle(session, row, now_s=now_s, limit=self._settings.failure_limit)

    def _take_back(self, job_id: str, found: Sequence[Finding], *, during: BackgroundJob, by_itself: bool) -> None:
        take_back_in_chunks(
            self._database, self._store, job_id, found,
            allowed=lambda row: row.background_job is during, by_itself=by_itself,
        )  # fmt: skip

    def _damaged_twice(self, job_id: str, found: Mapping[int, Sequence[Finding]]) -> dict[int, Finding]:
        """Return, by the task that failed, the damage of what the farm has made again before."""
        makers = {each.sequence for each_found in found.values() for each in each_found}
        with self._database.reading() as session:
            done = task_rows.numbered(session, job_id, makers, status=TaskStatus.DONE)
        again = {maker.sequence for maker in done if maker.repairs >= REPAIRS_ALLOWED}
        twice = {
            sequence: next((each for each in each_found if each.sequence in again), None)
            for sequence, each_found in found.items()
        }
        return {sequence: finding for sequence, finding in twice.items() if finding is not None}

    def _repair(self, session: Session, seen: Task, twice: Finding | None, now_s: float) -> None:
        """Let a waiting task go on once what it needs is made again, or fail it if the farm has done so before."""
        key = (seen.job_id, seen.sequence)
        state = task_sets.states(session, [key]).get(key)
        if state is None or (state.attempt, state.status) != (seen.attempt, TaskStatus.WAITING):
            return
        draft = TaskDraft(state)
        if twice is not None:
            message = f"{twice.message}; it was damaged before and made again, and is damaged again"
            error = {"error_code": ArtifactBroken.code, "error_message": message}
            draft.transition(TaskStatus.FAILED, permanent=True, ended_s=now_s, **error)
        elif task_rows.is_waiting_rightly(session, *key):
            draft.set(**NO_ERROR)
        else:
            self._count_failure(draft, now_s)
        write_drafts(session, [draft], now_s=now_s)

    def _count_failure(self, draft: TaskDraft, now_s: float) -> None:
        """Count a failure of which no damage is the cause: the artifacts are whole, so another worker may read them."""
        failures, worker = draft.now.failures + 1, draft.now.worker
        failed_on = list(dict.fromkeys([*draft.now.failed_on, *([worker] if worker else [])]))
        draft.set(failures=failures, failed_on=failed_on)
        if failures >= self._settings.failures_allowed:
            draft.transition(TaskStatus.FAILED, ended_s=now_s)
        else:
            pause_s = doubled_pause_s(self._settings.retry_pause_s, failures - 1)
            draft.transition(TaskStatus.READY, not_before_s=now_s + pause_s)
