"""Repairs of rows and of the store, by the functions that the coordinator uses.

Each repair of rows examines again and writes in one transaction of the single writer, so it is safe beside a farm that
runs: what it read remains true until it commits.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from lippmann.job.states import ENDED_JOBS, HELD_TASKS, JobStatus, TaskStatus
from lippmann.plan.artifact_store import ArtifactStore, LeavesPartialFiles
from service.coordinator.orphan_sweeper import sweep_orphans
from service.db import coordinator as coordinator_rows
from service.db import usage as usage_rows
from service.db.counters import recount
from service.db.engine import Database, changed
from service.db.migrations import migrate
from service.db.tables import BackgroundJob, CoordinatorRow, Job, Task
from service.doctor.farm_checks import check_farm
from service.doctor.finding import Check, Finding
from service.doctor.job_checks import check_jobs, count_tasks
from service.doctor.store import PARTIAL_S
from service.doctor.task_checks import check_attempts, check_dependents, check_held
from service.doctor.usage_checks import check_usage
from service.errors import NotFound
from service.jobs import artifact_repair
from service.jobs.completion import settle
from service.jobs.state_machine import release_tasks, set_job, transition_tasks
from service.settings import Settings


@dataclass(frozen=True)
class Place:
    """One transaction of a repair: its time and the settings of the farm."""

    session: Session
    settings: Settings
    now_s: float


Examine = Callable[[Place], Iterable[Finding]]
Repair = Callable[[Place, Finding], None]


def repair_rows(
    database: Database, settings: Settings, checks: Collection[Check], *, clock: Callable[[], float]
) -> None:
    """Repair the rows that violate some checks, in the order in which one repair may need another."""
    if Check.COORDINATOR in checks:
        migrate(database)
    for examine, repairs in _ROUNDS:
        if repairs.keys() & checks or Check.NOT_ENDED in repairs:
            with database.writing() as session:
                place = Place(session, settings, clock())
                for finding in list(examine(place)):
                    if finding.repairable and finding.check in repairs:
                        repairs[finding.check](place, finding)


def repair_store(database: Database, store: ArtifactStore, checks: Collection[Check], *, now_s: float) -> None:
    """Remove what nobody needs from the store."""
    if Check.ORPHANS in checks:
        sweep_orphans(database, store, now_s=now_s)
    if Check.PARTIAL_FILES in checks and isinstance(store, LeavesPartialFiles):
        store.sweep(PARTIAL_S)


def repair_artifacts(database: Database, store: ArtifactStore, findings: Iterable[Finding]) -> None:
    """Take back the tasks whose artifacts are missing or damaged, so that the farm makes these again."""
    for finding in findings:
        if finding.check is Check.ARTIFACTS and finding.repairable and finding.job_id is not None:
            with suppress(NotFound):  # the job was removed meanwhile
                artifact_repair.repair_tasks(database, store, finding.job_id, finding.sequences)


def _take_back(place: Place, finding: Finding) -> None:
    """Take tasks from attempts that should not hold them; they become ready."""
    held = [place.session.get_one(Task, (finding.job_id, sequence)) for sequence in finding.sequences]
    coordinator_rows.request_stop(place.session, {task.attempt for task in held}, now_s=place.now_s)
    for status in HELD_TASKS:
        _move(place, finding, status, TaskStatus.READY)


def _release(place: Place, finding: Finding) -> None:
    """Take the held tasks of an ended job back, as its end should have done."""
    row = _job(place, finding)
    to = TaskStatus.CANCELLED if row.status is JobStatus.CANCELLED else TaskStatus.READY
    if row.status in ENDED_JOBS:
        release_tasks(place.session, row, to=to, now_s=place.now_s)


def _free(place: Place, finding: Finding) -> None:
    _move(place, finding, TaskStatus.WAITING, TaskStatus.READY)


def _hold_back(place: Place, finding: Finding) -> None:
    """Let tasks wait that began too early; the table of transitions leads there through `cancelled`."""
    _take_back(place, finding)
    _move(place, finding, TaskStatus.READY, TaskStatus.CANCELLED)
    _move(place, finding, TaskStatus.CANCELLED, TaskStatus.WAITING)


def _recount(place: Place, finding: Finding) -> None:
    recount(place.session, _job(place, finding).id)


def _set_progress(place: Place, finding: Finding) -> None:
    counts = count_tasks(place.session, finding.job_id)[finding.job_id or ""]
    values = {name: getattr(counts, name) for name in ("total_px", "done_px", "frames_done")}
    set_job(place.session, _job(place, finding), **values)


def _recount_bytes(place: Place, finding: Finding) -> None:
    if finding.job_id is not None:
        usage_rows.recount_job(place.session, finding.job_id)
    usage_rows.recount_owners(place.session)


def _plan(place: Place, finding: Finding) -> None:
    """Let the planner plan a job, after another probe if its measurements are missing."""
    row = _job(place, finding)
    if row.probe is None:
        _move(place, finding, TaskStatus.DONE, TaskStatus.READY)
    else:
        set_job(place.session, row, background_job=BackgroundJob.PLAN)


def _settle(place: Place, finding: Finding) -> None:
    settle(place.session, _job(place, finding), now_s=place.now_s, limit=place.settings.failure_limit)


def _free_leadership(place: Place, _finding: Finding) -> None:
    changed(place.session, update(CoordinatorRow).values(leader=None, leader_until_s=0.0))


def _move(place: Place, finding: Finding, was: TaskStatus, to: TaskStatus) -> None:
    transition_tasks(place.session, finding.job_id or "", finding.sequences, was, to, progress=None)


def _job(place: Place, finding: Finding) -> Job:
    query = select(Job).where(Job.id == finding.job_id).execution_options(populate_existing=True)
    return place.session.scalars(query).one()


def _jobs(place: Place) -> Iterator[Finding]:
    return check_jobs(place.session, place.settings)


_ROUNDS: tuple[tuple[Examine, Mapping[Check, Repair]], ...] = (
    (lambda place: check_attempts(place.session), {Check.HELD_TWICE: _take_back}),
    (
        lambda place: check_held(place.session),
        {Check.HELD_BY_NOBODY: _take_back, Check.HELD_AFTER_END: _release},
    ),
    (
        lambda place: check_farm(place.session, place.settings, now_s=place.now_s),
        {Check.IDLE_CLOCK: _take_back, Check.LEADER: _free_leadership},
    ),
    (lambda place: check_dependents(place.session), {Check.STUCK: _free, Check.TOO_EARLY: _hold_back}),
    (_jobs, {Check.COUNTERS: _recount, Check.PROGRESS: _set_progress}),
    (_jobs, {Check.UNPLANNED: _plan}),
    (lambda place: check_usage(place.session), {Check.USAGE: _recount_bytes}),
    (_jobs, {Check.NOT_ENDED: _settle}),
)
"""The rounds of a repair. Ends come last, since they follow from the counters."""
