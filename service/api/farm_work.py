"""The work of the farm now: what workers run and what seems to be stuck, which jobs wait, and who uses how much."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy.orm import Session

from lippmann.job.rendering.workers import JobRequirement
from lippmann.job.states import TaskStatus
from lippmann.plan import artifact_names as names
from service.api.waits import Outlook, job_waits
from service.claiming import is_able
from service.db import work as work_rows
from service.db.tables import Job, Task
from service.ids import task_id
from service.schemas.answer import utc_or_none
from service.schemas.links import artifact_url, poster_url
from service.schemas.wait import Wait
from service.schemas.work import FarmTask, FarmWork, OwnerWork, OwnerWorkList, Stuck, StuckCode, WaitingJobs

MOST = 500
"""The largest number of tasks and of waiting jobs that are listed."""
NAMED = 10
"""The largest number of jobs that are named for one reason to wait."""
PICTURES = 50
"""The largest number of jobs of which a picture is looked up."""
SLOW = 5.0
"""A task is slow if it has run so many times as long as tasks of its size take in the same job."""
SLOW_S = 120.0
"""A task is not slow before it has run so long."""


def farm_work(session: Session, outlook: Outlook, *, owner_id: str | None) -> FarmWork:
    """Return the work of the farm now, without the figures of the store; only the jobs that an owner sees, if given."""
    jobs = {job.id: job for job in work_rows.busy_jobs(session, owner_id=owner_id)}
    tasks = work_rows.held_tasks(session, jobs, limit=MOST + 1) if jobs else ()
    shown = tasks[:MOST]
    pictures = _pictures(session, [jobs[job_id] for job_id in dict.fromkeys(task.job_id for task in shown)])
    has_free_slot = _has_free_slot(outlook)
    rows = work_rows.waiting_jobs(session, owner_id=owner_id, limit=MOST + 1)
    waits = job_waits(session, rows[:MOST], outlook)
    return FarmWork(
        tasks=tuple(
            _task(task, jobs[task.job_id], pictures.get(task.job_id), outlook, has_free_slot=has_free_slot)
            for task in shown
        ),
        waiting=waiting_jobs([(row, waits[row.id]) for row in rows[:MOST] if row.id in waits]),
        more=len(tasks) > MOST or len(rows) > MOST,
        free_bytes=None,
        free_files=None,
        artifact_bytes=None,
    )


def owner_work(session: Session, *, owner_id: str | None) -> OwnerWorkList:
    """Return what the jobs of owners took, only those of one owner if given."""
    return OwnerWorkList(
        items=tuple(
            OwnerWork(
                owner_id=owner,
                name=name,
                jobs=int(jobs),
                open_jobs=int(open_jobs),
                running_tasks=int(running),
                frames_done=int(frames),
                cpu_s=float(cpu_s),
                artifact_bytes=int(stored),
            )
            for owner, name, jobs, open_jobs, running, frames, cpu_s, stored in work_rows.owners(
                session, owner_id=owner_id
            )
        )
    )


def waiting_jobs(found: Sequence[tuple[Job, Wait]]) -> tuple[WaitingJobs, ...]:
    """Return jobs that wait by engine and reason, the most first."""
    groups: dict[tuple[str, str], list[tuple[Job, Wait]]] = {}
    for row, wait in sorted(found, key=lambda one: (-one[0].priority, one[0].id)):
        engine = JobRequirement.of(row.requirement).engine
        groups.setdefault((engine, wait.code), []).append((row, wait))
    items = (
        WaitingJobs(
            engine=engine,
            code=members[0][1].code,
            message=members[0][1].message,
            jobs=len(members),
            ready_tasks=sum(row.ready for row, _ in members),
            first=tuple(row.id for row, _ in members[:NAMED]),
        )
        for (engine, _), members in groups.items()
    )
    return tuple(sorted(items, key=lambda item: -item.jobs))


def stuck_sign(
    task: Task, *, now_s: float, expected_s: float | None, lost_s: float, unclaimed_s: float, has_free_slot: bool
) -> Stuck | None:
    """Return why a task that an attempt owns seems to be stuck; None if it does not.

    Parameters
    ----------
    expected_s
        The time that tasks of its size take in the same job; None if nothing is measured.
    lost_s
        The time without a heartbeat after which the attempt is lost.
    unclaimed_s
        The time for which an order waits for a free slot before it is taken back.
    """
    if task.status is TaskStatus.DISPATCHED:
        waited_s = now_s - (task.dispatched_s or now_s)
        if not has_free_slot or waited_s <= unclaimed_s:
            return None
        message = f"No worker has taken its order for {waited_s:.0f} s, although a slot is free."
        return Stuck(code=StuckCode.NOT_CLAIMED, message=message)
    silent_s = now_s - (task.heartbeat_s or task.claimed_s or now_s)
    if silent_s > lost_s / 3:
        message = f"Its worker has not reported it for {silent_s:.0f} s; after {lost_s:.0f} s it goes to another one."
        return Stuck(code=StuckCode.SILENT, message=message)
    running_s = now_s - (task.claimed_s or now_s)
    if expected_s is not None and running_s > max(SLOW_S, SLOW * expected_s):
        message = f"It has run for {running_s:.0f} s; tasks of its size take about {expected_s:.0f} s in this job."
        return Stuck(code=StuckCode.SLOW, message=message)
    return None


def _task(task: Task, job: Job, picture: str | None, outlook: Outlook, *, has_free_slot: bool) -> FarmTask:
    measured_px = job.done_px - job.cached_px
    expected_s = task.weight_px * job.wall_s / measured_px if measured_px > 0 and job.wall_s else None
    settings = outlook.settings
    stuck = stuck_sign(
        task, now_s=outlook.now_s, expected_s=expected_s, lost_s=settings.lease_ttl_s,
        unclaimed_s=settings.unclaimed_s, has_free_slot=has_free_slot,
    )  # fmt: skip
    return FarmTask(
        id=task_id(task.job_id, task.sequence),
        job_id=task.job_id,
        job_title=job.title or job.scene,
        owner_id=job.owner_id,
        kind=task.kind,
        status=task.status,
        frame=task.frame,
        tile=task.tile,
        output=task.output,
        worker=task.worker if task.status is TaskStatus.RUNNING else None,
        progress=task.progress,
        attempt_number=task.attempt_number,
        dispatched_at=utc_or_none(task.dispatched_s),
        started_at=utc_or_none(task.claimed_s),
        heard_at=utc_or_none(task.heartbeat_s),
        stuck=stuck,
        picture=picture,
    )


def _has_free_slot(outlook: Outlook) -> bool:
    able = filter(is_able, outlook.roster.present if outlook.roster is not None else ())
    return any(len(worker.holds) < worker.slots for worker in able if worker.holds is not None)


def _pictures(session: Session, jobs: Sequence[Job]) -> dict[str, str]:
    """Return the path of a small picture of each job that has one."""
    looked_up = jobs[:PICTURES]
    posters = work_rows.scenes_with_posters(session, {job.scene for job in looked_up}) if looked_up else set()
    found = {}
    for job in looked_up:
        frame = work_rows.newest_frame(session, job.id) if job.frames_done else None
        if frame is not None:
            found[job.id] = artifact_url(job.id, names.thumb_name(frame))
        elif job.scene in posters:
            found[job.id] = poster_url(job.scene)
    return found
