"""Why a job or a task waits, from rows and the state of the farm. Pure.

The questions are asked in the order in which they prevent work: whether the job goes on at all, whether the farm
dispatches anything, whether the task may be dispatched, and at last which jobs get the slots first. The last answer
follows from the rule that the scheduler uses, `service.jobs.fair_share`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from lippmann.job.states import ENDED_JOBS, JobStatus, PausedBy, TaskStatus
from service.claiming import declining_workers
from service.db.tables import BackgroundJob, Job, Task
from service.jobs.artifact_repair import CODES as UNREADABLE
from service.jobs.fair_share import Claim, is_at_limit, is_full, share_out
from service.jobs.farm_state import NAMED, FarmState, wait_for_workers, wait_of
from service.jobs.limits import claim_of
from service.limits import Limits
from service.schemas.access import KeyLimits
from service.schemas.answer import utc_or_none
from service.schemas.wait import Wait, WaitCode

_PREPARATIONS: Mapping[BackgroundJob | None, WaitCode] = {
    BackgroundJob.PLAN: WaitCode.PREPARATION,
    BackgroundJob.RETRY: WaitCode.PREPARATION,
    BackgroundJob.REPAIR: WaitCode.VERIFICATION,
    BackgroundJob.VERIFY: WaitCode.VERIFICATION,
}


@dataclass(frozen=True)
class JobState:
    """The facts about one job that a page of jobs or tasks has besides its row."""

    row: Job
    avoided: Collection[str] = ()
    """The workers that the job avoids now."""
    first_ready: int | None = None
    """The sequence number of its first task that may be dispatched now; None if no task may be."""
    delayed: Task | None = None
    """The ready task that may be dispatched soonest, if none may be dispatched now."""


@dataclass(frozen=True)
class Needs:
    """The unfinished tasks of a stage that other tasks need."""

    count: int
    failed: int
    first: Sequence[str] = field(default=())
    """The ids of some of them."""


def job_wait(job: JobState, farm: FarmState) -> Wait | None:
    """Return why no task of a job runs; None for a job that has ended, and for one that works."""
    row, farm = job.row, farm.of_job(job.row)
    if row.status in ENDED_JOBS:
        return None
    paused = _pause(row)
    if paused is not None or row.running:
        return paused
    wait = _farm_wait(row, farm)
    if wait is not None:
        return wait
    if row.dispatched:
        return _order_wait(row, farm)
    if not row.ready:
        return wait_of(WaitCode.EARLIER_STAGE, "Its tasks need others that are not done.") if row.waiting else None
    return _hindrance(job.delayed, job, farm) or _turn(row, farm)


def task_wait(task: Task, job: JobState, farm: FarmState, needs: Needs | None = None) -> Wait | None:
    """Return why a task waits; None for a task that runs or has ended, and for every task of an ended job.

    Parameters
    ----------
    needs
        The unfinished tasks of the stage that the task needs.
    """
    row, farm = job.row, farm.of_job(job.row, task.kind)
    if row.status in ENDED_JOBS or task.status not in (TaskStatus.WAITING, TaskStatus.READY, TaskStatus.DISPATCHED):
        return None
    wait = _pause(row) or (_blocked(task, needs) if task.status is TaskStatus.WAITING else _farm_wait(row, farm))
    if wait is not None:
        return wait
    if task.status is TaskStatus.DISPATCHED:
        return _order_wait(row, farm)
    return _hindrance(task, job, farm) or _task_turn(task, job, farm)


def rank(claim: Claim) -> tuple[int, int, str]:
    """Return the place of a job among those that want slots, the lowest first."""
    return -claim.priority, claim.outstanding, claim.job_id


def _pause(row: Job) -> Wait | None:
    if row.status is not JobStatus.PAUSED:
        return None
    if row.paused_by is PausedBy.FARM:
        return wait_of(WaitCode.PAUSED_BY_FARM, f"The farm has paused it: {row.pause_reason}", fault=row.pause_code)
    return wait_of(WaitCode.PAUSED)


def _farm_wait(row: Job, farm: FarmState) -> Wait | None:
    """Return why the farm dispatches nothing, or nothing of this job."""
    if not farm.has_leader:
        return wait_of(WaitCode.NO_COORDINATOR)
    if row.background_job in _PREPARATIONS:
        return wait_of(_PREPARATIONS[row.background_job])
    if farm.faults:
        cause = farm.faults[0]
        return wait_of(WaitCode.FARM_FAULT, cause.message, fault=cause.code)
    return wait_for_workers(farm)


def _blocked(task: Task, needs: Needs | None) -> Wait:
    if task.error_code in UNREADABLE:
        message = f"It could not read an artifact, which is verified and made again: {task.error_message}"
        return wait_of(WaitCode.ARTIFACT_REPAIR, message, fault=task.error_code)
    if needs is None or not needs.count:
        return wait_of(WaitCode.EARLIER_STAGE, f"It needs the stage {task.needs}, which has just ended.")
    failed = f"; {needs.failed} of them failed" if needs.failed else ""
    what = f"{_many(needs.count, 'task')} of the stage {task.needs} that {'is' if needs.count == 1 else 'are'} not done"
    return wait_of(WaitCode.EARLIER_STAGE, f"It needs {what}{failed}.", tasks=tuple(needs.first[:NAMED]))


def _order_wait(row: Job, farm: FarmState) -> Wait:
    """Return why an order that was sent is not claimed."""
    if farm.has_free_slot:
        return wait_of(WaitCode.STARTING)
    jobs = _names(claim for claim in farm.holders if claim.job_id != row.id)
    return wait_of(WaitCode.ORDER_SENT, f"Its order is in the queue, and {_busy(farm)}.", jobs=jobs)


def _hindrance(task: Task | None, job: JobState, farm: FarmState) -> Wait | None:
    """Return why a ready task may not be dispatched now, or only to workers that are busy."""
    avoidance = _avoidance(job, task.failed_on if task is not None else (), farm)
    if task is None or task.not_before_s is None or task.not_before_s <= farm.now_s:
        return avoidance
    delay_s = task.not_before_s - farm.now_s
    if delay_s <= farm.settings.decline_pause_s and avoidance is not None:
        return avoidance  # a worker that declines the order causes this delay, again and again
    return _delay(task, delay_s) if task.failures or task.losses or task.deferrals else avoidance


def _delay(task: Task, delay_s: float) -> Wait:
    if task.deferrals:
        code, begin = WaitCode.DEFERRED, "Something outside the task prevented it"
    else:
        code, begin = WaitCode.RETRY_DELAY, f"{_many(task.failures + task.losses, 'attempt')} failed"
    message = f"{begin}, and it is tried again in {delay_s:.0f} s: {task.error_message}"
    return wait_of(code, message, fault=task.error_code, until_at=utc_or_none(task.not_before_s))


def _avoidance(job: JobState, failed_on: Collection[str], farm: FarmState) -> Wait | None:
    """Return that the workers which may do the work are busy, while others that it avoids are not."""
    declining = {*declining_workers(farm.able, {*job.avoided, *failed_on})}
    free = {worker.name for worker in farm.able if worker.holds is not None and len(worker.holds) < worker.slots}
    if not declining & free or free - declining:
        return None
    names = tuple(sorted(declining))
    message = f"It avoids {', '.join(names)}, where it or its job failed, and the other workers have no free slot."
    return wait_of(WaitCode.WORKERS_AVOIDED, message, workers=names)


def _task_turn(task: Task, job: JobState, farm: FarmState) -> Wait:
    """Return what gets the slots before a ready task."""
    turn = _turn(job.row, farm)
    if turn.code in (WaitCode.SLOT_LIMIT, WaitCode.HIGHER_PRIORITY):
        return turn
    is_next = job.first_ready is None or task.sequence <= job.first_ready
    if turn.code is WaitCode.STARTING and (is_next or _granted(job.row, farm) >= job.row.ready):
        return turn
    is_behind_own = turn.code is WaitCode.SLOTS_BUSY and not turn.jobs and job.row.dispatched + job.row.running > 0
    return turn if is_next and not is_behind_own else wait_of(WaitCode.EARLIER_TASKS)


def _granted(row: Job, farm: FarmState) -> int:
    """Return how many tasks of a job the next round of the scheduler dispatches."""
    line = [*(claim for claim in farm.line if claim.job_id != row.id), _claim(row, farm)]
    rooms = farm.rooms([farm.asked])
    return share_out(line, farm.room(), held=farm.held, rooms=rooms).get(row.id, 0)


def _claim(row: Job, farm: FarmState) -> Claim:
    outstanding = row.dispatched + row.running
    limits = (row.owner_id, row.max_slots, farm.asked, row.own_slots)
    return claim_of((row.id, row.priority, outstanding, row.ready, *limits), farm.settings)


def _turn(row: Job, farm: FarmState) -> Wait:
    """Return which jobs get the slots before a job that has tasks which may be dispatched now."""
    own = _claim(row, farm)
    if is_full(own, own.outstanding):
        held = f"It holds {_many(own.outstanding, 'slot')}; expected at most {own.own_slots} (slots of the job)."
        return wait_of(WaitCode.SLOT_LIMIT, held)
    if is_at_limit(own, farm.held):
        return _at_limit(row, farm)
    if _granted(row, farm):
        return wait_of(WaitCode.STARTING)
    others = {claim.job_id: claim for claim in (*farm.line, *farm.holders) if claim.job_id != row.id}
    higher = sorted((claim for claim in others.values() if claim.priority > row.priority), key=rank)
    if higher:
        begin = (
            "1 job with a higher priority gets"
            if len(higher) == 1
            else f"{len(higher)} jobs with higher priorities get"
        )
        return wait_of(WaitCode.HIGHER_PRIORITY, f"{begin} the slots first.", jobs=_names(higher))
    fewer = sorted((claim for claim in farm.line if claim.job_id != row.id and rank(claim) < rank(own)), key=rank)
    if fewer:
        verb = "gets" if len(fewer) == 1 else "get"
        message = f"{_many(len(fewer), 'job')} of the same priority, with fewer orders or submitted before it, {verb} "
        return wait_of(WaitCode.FAIR_SHARE, f"{message}the slots first.", jobs=_names(fewer))
    holders = _names(claim for claim in farm.holders if claim.job_id != row.id)
    return wait_of(WaitCode.SLOTS_BUSY, f"It is the next one, but {_busy(farm)}.", jobs=holders)


def _at_limit(row: Job, farm: FarmState) -> Wait:
    limit = Limits(farm.settings, KeyLimits(slots=row.max_slots))["slots"]
    message = f"The jobs of its owner hold {_many(farm.held[row.owner_id], 'slot')}; expected {limit}."
    jobs = _names(claim for claim in farm.holders if claim.owner_id == row.owner_id and claim.job_id != row.id)
    return wait_of(WaitCode.SLOT_LIMIT, message, jobs=jobs)


def _busy(farm: FarmState) -> str:
    return "the only slot is busy" if farm.slots == 1 else f"all {farm.slots} slots are busy"


def _many(count: int, thing: str) -> str:
    return f"{count} {thing}{'' if count == 1 else 's'}"


def _names(claims: Iterable[Claim]) -> tuple[str, ...]:
    return tuple(claim.job_id for claim in claims)[:NAMED]
