"""Planning: the result of the probe becomes tasks, in one transaction per chunk.

A crash between two transactions loses nothing. The division into tiles is decided once and stored in the row of the
job, so that a later process continues the same plan; the highest task number gives the point to continue.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

from sqlalchemy import insert, update
from sqlalchemy.orm import Session

from lippmann.job.messages.events import Presence, ProbeResult
from lippmann.job.resolved import ResolvedJob, StoredPlan
from lippmann.job.spec import JobSpec
from lippmann.job.states import JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore
from lippmann.plan.tasks import PlannedTask, plan_sheet, plan_tasks
from service.claiming import fitting, is_able
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.counters import add_to_counters
from service.db.engine import Database, changed
from service.db.tables import BackgroundJob, Job, Task
from service.jobs.completion import settle
from service.jobs.limits import task_count
from service.jobs.state_machine import set_job, transition_job
from service.settings import FailureLimit, Settings


@dataclass(frozen=True)
class Capacity:
    """The workers for which jobs are planned."""

    slots: int
    workers: int = 0
    """The number of workers that have these slots; 0 if it is not known."""
    fleet: Sequence[Presence] = ()
    """The workers that take orders; empty if they are not known."""

    def of_job(self, row: Job) -> Capacity:
        """Return the capacity that a job may use: of the workers that it may have, within its own limit."""
        able = [worker for worker in fitting(self.fleet, row.requirement) if is_able(worker)]
        slots = sum(worker.slots for worker in able) if able else self.slots
        workers = len(able) if able else self.workers
        return Capacity(slots if row.own_slots is None else min(slots, row.own_slots), workers)


class Planner:
    """Plans jobs in chunks. It keeps nothing in memory but the positions of its iterators."""

    def __init__(self, database: Database, store: ArtifactStore, settings: Settings) -> None:
        self._database = database
        self._store = store
        self._settings = settings
        self._iterators: dict[str, tuple[int, Iterator[PlannedTask]]] = {}

    def plan_chunk(self, job_id: str, capacity: Capacity, *, now_s: float) -> bool:
        """Plan the next chunk of a job; return whether there is more."""
        with self._database.reading() as session:
            row = session.get(Job, job_id)
            if row is None or row.background_job is not BackgroundJob.PLAN:
                self._iterators.pop(job_id, None)
                return False
            spec, sheet, for_job = row.parsed_spec, row.plan, capacity.of_job(row)
            probe = ProbeResult.model_validate(row.probe)
            reached = task_rows.last_sequence(session, job_id)
            is_busy = sheet is None and any(job_rows.outstanding(session).values())
        if sheet is None:
            clock = self._resolved(job_id).clock
            idle = 0 if is_busy else for_job.workers
            planned = plan_sheet(spec, probe, slots=max(1, for_job.slots), idle_workers=idle, clock=clock)
            self._decide(job_id, _with_few_tasks(spec, planned, self._settings.max_tasks))
            return True
        decided = StoredPlan.model_validate(sheet)
        if reached == 0:  # only the probe exists, so no task has read the artifact
            self._store_sheet(job_id, decided)
        chunk = self._next_chunk(job_id, reached, spec, decided)
        more = self._write(job_id, chunk, now_s)
        if not more and reached >= task_rows.CHUNK:
            self._database.count_tasks()
        return more

    def _resolved(self, job_id: str) -> ResolvedJob:
        return ResolvedJob.model_validate_json(self._store.get_bytes(names.job_artifact(job_id, names.JOB_FILE)))

    def _decide(self, job_id: str, sheet: StoredPlan) -> None:
        with self._database.writing() as session:
            statement = update(Job).where(
                Job.id == job_id, Job.background_job == BackgroundJob.PLAN, Job.plan.is_(None)
            )
            changed(session, statement.values(plan=sheet.model_dump()))

    def _store_sheet(self, job_id: str, sheet: StoredPlan) -> None:
        # It is written from the row, so that a process that no longer leads writes the same, and before the first task.
        # Workers need no previews, and those of an earlier release refuse a field that they do not know. They have to
        # refuse a job whose rig depends on the scene's camera.
        unneeded = {"previews"} if sheet.camera else {"previews", "camera"}
        text = sheet.model_dump_json(indent=2, exclude=unneeded)
        self._store.put_bytes(names.job_artifact(job_id, names.PLAN_FILE), text.encode())

    def _next_chunk(self, job_id: str, reached: int, spec: JobSpec, sheet: StoredPlan) -> list[PlannedTask]:
        at, iterator = self._iterators.pop(job_id, (-1, iter(())))
        if at != reached:
            iterator = (task for task in plan_tasks(spec, sheet) if task.sequence > reached)
        chunk = list(islice(iterator, task_rows.CHUNK))
        if len(chunk) == task_rows.CHUNK:
            self._iterators[job_id] = (chunk[-1].sequence, iterator)
        return chunk

    def _write(self, job_id: str, chunk: list[PlannedTask], now_s: float) -> bool:
        with self._database.writing() as session:
            row = session.get(Job, job_id)
            if row is None or row.background_job is not BackgroundJob.PLAN:
                return False
            insert_tasks(session, job_id, chunk)
            session.refresh(row)
            if len(chunk) == task_rows.CHUNK:
                return True
            _complete(session, row, now_s, self._settings.failure_limit)
            return False


def _with_few_tasks(spec: JobSpec, sheet: StoredPlan, most: int) -> StoredPlan:
    """Return a plan with whole frames if automatic tiles would make too many tasks."""
    if spec.render.tiles != "auto" or task_count(spec, tile_rows=sheet.tile_rows, tile_cols=sheet.tile_cols) <= most:
        return sheet
    return sheet.model_copy(update={"tile_rows": 1, "tile_cols": 1})


def insert_tasks(session: Session, job_id: str, tasks: list[PlannedTask]) -> None:
    """Insert planned tasks and add them to the counters of the job."""
    if not tasks:
        return
    session.connection().execute(insert(Task), [_row(job_id, task) for task in tasks])
    ready = sum(task.needs is None for task in tasks)
    counts = {TaskStatus.READY.value: ready, TaskStatus.WAITING.value: len(tasks) - ready}
    add_to_counters(session, {job_id: counts | {"total_px": sum(task.weight_px for task in tasks)}})


def _complete(session: Session, row: Job, now_s: float, limit: FailureLimit) -> None:
    set_job(session, row, background_job=None, planned_s=now_s)
    if row.status is JobStatus.PROBING:
        transition_job(session, row, JobStatus.RUNNING)
    settle(session, row, now_s=now_s, limit=limit)


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
