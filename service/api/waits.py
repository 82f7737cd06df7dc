"""Why jobs and tasks wait: a handful of queries for a page of them, and none for a page on which nothing waits."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from lippmann.job.states import ENDED_JOBS, JobStatus, TaskStatus
from service.claiming import not_able
from service.db import coordinator as coordinator_rows
from service.db import jobs as job_rows
from service.db import waiting as waiting_rows
from service.db.faults import avoided_workers
from service.db.tables import Job, Task
from service.ids import task_id
from service.jobs.fair_share import is_at_limit, slots_by_owner
from service.jobs.farm_state import NAMED, FarmState
from service.jobs.limits import claim_of
from service.jobs.waiting import JobState, Needs, job_wait, task_wait
from service.roster import Roster
from service.schemas.wait import Wait
from service.settings import Settings

_WAITING = frozenset({TaskStatus.WAITING, TaskStatus.READY, TaskStatus.DISPATCHED})
_SMALL_STAGE = 100
"""The size of a stage up to which all of its tasks are read."""


@dataclass(frozen=True)
class Outlook:
    """The facts that decide how long things wait and are not in the database."""

    now_s: float
    settings: Settings
    roster: Roster | None
    """The workers that are online; None if the broker does not answer."""


def job_waits(session: Session, rows: Sequence[Job], outlook: Outlook) -> dict[str, Wait]:
    """Return why the jobs of a page wait, by job."""
    waiting = [
        row for row in rows if row.status not in ENDED_JOBS and (row.status is JobStatus.PAUSED or not row.running)
    ]
    if not waiting:
        return {}
    farm = _farm_state(session, outlook)
    ids = [row.id for row in waiting if row.ready and not row.dispatched]
    delayed = waiting_rows.delayed(session, ids, now_s=outlook.now_s) if ids else {}
    avoided = avoided_workers(session, ids, now_s=outlook.now_s) if ids else {}
    states = [JobState(row, avoided.get(row.id, ()), delayed=delayed.get(row.id)) for row in waiting]
    waits = {state.row.id: job_wait(state, farm) for state in states}
    return {job_id: _shared(wait, outlook) for job_id, wait in waits.items() if wait is not None}


def task_waits(session: Session, row: Job, tasks: Sequence[Task], outlook: Outlook) -> dict[int, Wait]:
    """Return why the tasks of a page of a job wait, by sequence number."""
    waiting = [task for task in tasks if task.status in _WAITING]
    if row.status in ENDED_JOBS or not waiting:
        return {}
    farm = _farm_state(session, outlook)
    avoided = avoided_workers(session, [row.id], now_s=outlook.now_s)[row.id]
    job = JobState(row, avoided, first_ready=waiting_rows.first_ready(session, row.id, now_s=outlook.now_s))
    stages = {task.needs for task in waiting if task.status is TaskStatus.WAITING and task.needs is not None}
    needs = _needs(session, row.id, stages) if stages else {}
    waits = {task.sequence: task_wait(task, job, farm, needs.get(task.needs or "")) for task in waiting}
    return {sequence: _shared(wait, outlook) for sequence, wait in waits.items() if wait is not None}


def _shared(wait: Wait, outlook: Outlook) -> Wait:
    """Return a reason without the ids of jobs unless everybody may see all jobs."""
    return wait if outlook.settings.sharing else wait.model_copy(update={"jobs": ()})


def _farm_state(session: Session, outlook: Outlook) -> FarmState:
    settings = outlook.settings
    busy = waiting_rows.holders(session)
    holders = tuple(claim_of(row[:-1], settings) for row in busy)
    held = slots_by_owner(holders)
    full = {claim.owner_id: held[claim.owner_id] for claim in holders if is_at_limit(claim, held)}
    line = waiting_rows.line(session, now_s=outlook.now_s, max_slots=settings.max_slots, held=full)
    present = outlook.roster.present if outlook.roster is not None else ()
    on_closed = job_rows.running_on(session, not_able(present))
    others = job_rows.outstanding_without_engine(session, {claim.requirement for claim in holders})
    without_engine: Counter[str] = Counter()
    for _, requirement, count in others:
        without_engine[requirement] += count
    return FarmState(
        now_s=outlook.now_s,
        settings=settings,
        has_leader=coordinator_rows.leader(session, now_s=outlook.now_s) is not None,
        faults=coordinator_rows.faults(session),
        roster=outlook.roster,
        line=tuple(claim_of(row, settings) for row in line),
        holders=holders,
        running=sum(row[-1] for row in busy) - sum(on_closed.values()),
        on_closed=on_closed,
        without_engine=without_engine,
    )


def _needs(session: Session, job_id: str, stages: set[str]) -> Mapping[str, Needs]:
    counts: Counter[str] = Counter()
    failed: Counter[str] = Counter()
    for stage, status, count in waiting_rows.unfinished(session, job_id, stages):
        counts[stage] += count
        failed[stage] += count if status is TaskStatus.FAILED else 0
    small = [stage for stage, count in counts.items() if count <= _SMALL_STAGE]
    found = [*waiting_rows.members(session, job_id, small)] if small else []
    for stage in counts.keys() - set(small):
        found += waiting_rows.members(session, job_id, [stage], limit=NAMED)
    first: dict[str, list[str]] = defaultdict(list)
    for stage, sequence in found:
        first[stage].append(task_id(job_id, sequence))
    return {stage: Needs(counts[stage], failed[stage], first[stage]) for stage in counts}
