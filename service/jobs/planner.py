"""The probe's result becomes tasks, a chunk a transaction; a crash at any line is gone on from.

The cut is decided once and kept in the job's row, so that whoever goes on goes on with the same plan; tasks are
numbered, so the highest number says where to go on.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from sqlalchemy import insert, update
from sqlalchemy.orm import Session

from lippmann.job.events import ProbeResult
from lippmann.job.resolved import PlanSheet
from lippmann.job.spec import JobSpec
from lippmann.job.states import JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from lippmann.plan.tasks import PlannedTask, plan_sheet, plan_tasks
from service.api.presenters import spec_of
from service.db import tasks as task_rows
from service.db.counters import shift
from service.db.engine import Database, changed
from service.db.tables import Chore, Job, Task
from service.jobs.completion import settle
from service.jobs.state_machine import move_job, set_job
from service.ports import ArtifactStore
from service.settings import Settings


class Planner:
    """Plans jobs in pieces. What it keeps in memory is only where its iterators stand."""

    def __init__(self, database: Database, store: ArtifactStore, settings: Settings) -> None:
        self._database = database
        self._store = store
        self._settings = settings
        self._going: dict[str, tuple[int, Iterator[PlannedTask]]] = {}

    def plan_some(self, job_id: str, *, slots: int, now_s: float) -> bool:
        """Do the next piece of planning a job; True while there is more."""
        with self._database.reading() as session:
            row = session.get(Job, job_id)
            if row is None or row.chore is not Chore.PLAN:
                self._going.pop(job_id, None)
                return False
            spec, sheet = spec_of(row), row.plan
            probe = ProbeResult.model_validate(row.probe)
            reached = task_rows.last_sequence(session, job_id)
        if sheet is None:
            self._decide(job_id, plan_sheet(spec, probe, slots=max(1, slots)))
            return True
        decided = PlanSheet.model_validate(sheet)
        if reached == 0:  # only the probe is there: nobody has needed the artifact yet
            self._store_sheet(job_id, decided)
        chunk = self._next_chunk(job_id, reached, spec, decided)
        return self._write(job_id, chunk, now_s)

    def _decide(self, job_id: str, sheet: PlanSheet) -> None:
        with self._database.writing() as session:
            statement = update(Job).where(Job.id == job_id, Job.chore == Chore.PLAN, Job.plan.is_(None))
            changed(session, statement.values(plan=sheet.model_dump()))

    def _store_sheet(self, job_id: str, sheet: PlanSheet) -> None:
        # After the row and from the row, so that a clerk that no longer leads writes the same; before the first task.
        self._store.put_bytes(names.job_artifact(job_id, names.PLAN_SHEET), sheet.model_dump_json(indent=2).encode())

    def _next_chunk(self, job_id: str, reached: int, spec: JobSpec, sheet: PlanSheet) -> list[PlannedTask]:
        at, iterator = self._going.pop(job_id, (-1, iter(())))
        if at != reached:
            iterator = (task for task in plan_tasks(spec, sheet) if task.sequence > reached)
        chunk = list(islice(iterator, task_rows.CHUNK))
        if len(chunk) == task_rows.CHUNK:
            self._going[job_id] = (chunk[-1].sequence, iterator)
        return chunk

    def _write(self, job_id: str, chunk: list[PlannedTask], now_s: float) -> bool:
        with self._database.writing() as session:
            row = session.get(Job, job_id)
            if row is None or row.chore is not Chore.PLAN:
                return False
            insert_tasks(session, job_id, chunk)
            session.refresh(row)
            if len(chunk) == task_rows.CHUNK:
                return True
            _complete(session, row, now_s, self._settings.failed_share)
            return False


def insert_tasks(session: Session, job_id: str, tasks: list[PlannedTask]) -> None:
    """Insert planned tasks and count them in the job's row."""
    if not tasks:
        return
    session.execute(insert(Task), [_row(job_id, task) for task in tasks])
    ready = sum(task.needs is None for task in tasks)
    counts = {TaskStatus.READY: ready, TaskStatus.WAITING: len(tasks) - ready}
    shift(session, job_id, counts, total_px=sum(task.weight_px for task in tasks))


def _complete(session: Session, row: Job, now_s: float, failed_share: float) -> None:
    set_job(session, row, chore=None, planned_s=now_s)
    if row.status is JobStatus.PROBING:
        move_job(session, row, JobStatus.RUNNING)
    settle(session, row, now_s=now_s, failed_share=failed_share)


def _row(job_id: str, task: PlannedTask) -> dict[str, object]:
    return {
        "job_id": job_id,
        "sequence": task.sequence,
        "kind": task.kind,
        "stage": task.stage,
        "needs": task.needs,
        "frame": task.frame,
        "tile_row": task.tile.row if task.tile else None,
        "tile_col": task.tile.col if task.tile else None,
        "output": task.output,
        "artifact": task.artifact,
        "weight_px": task.weight_px,
        "status": TaskStatus.WAITING if task.needs else TaskStatus.READY,
        "failed_on": [],
    }
