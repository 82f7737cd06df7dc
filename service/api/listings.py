"""Pages of jobs, tasks and frames. A cursor is the place after which the next page begins."""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict

from sqlalchemy.orm import Session

from lippmann.errors import FieldProblem
from lippmann.job.orders import TaskKind
from lippmann.job.states import JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from service.api import presenters as show
from service.api.frame_status import frame_status
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.tables import Task
from service.errors import Invalid, NotFound
from service.ids import parse_task_id
from service.jobs.state_machine import find_job
from service.schemas import frame as frame_schema
from service.schemas import job as job_schema
from service.schemas import task as task_schema
from service.schemas.frame import FrameStatus


def page_jobs(session: Session, *, status: JobStatus | None, cursor: str | None, limit: int) -> job_schema.JobPage:
    """Return jobs, newest first."""
    rows = job_rows.page(session, status=status, before=cursor, limit=limit + 1)
    shown = rows[:limit]
    return job_schema.JobPage(
        items=show.show_jobs(session, shown), next_cursor=shown[-1].id if len(rows) > limit else None
    )


def page_tasks(
    session: Session,
    job_id: str,
    *,
    status: TaskStatus | None,
    kind: TaskKind | None,
    cursor: str | None,
    limit: int,
) -> task_schema.TaskPage:
    """Return tasks of a job in order."""
    find_job(session, job_id)
    rows = task_rows.page(session, job_id, status=status, kind=kind, after=number_in(cursor), limit=limit + 1)
    shown = rows[:limit]
    items = tuple(show.show_task(row) for row in shown)
    return task_schema.TaskPage(items=items, next_cursor=str(shown[-1].sequence) if len(rows) > limit else None)


def find_task(session: Session, job_id: str, task_id: str) -> Task:
    """Return a task of a job.

    Raises
    ------
    NotFound
        If the job has none of this name.
    """
    find_job(session, job_id)
    of_job, sequence = parse_task_id(task_id)
    row = task_rows.task(session, of_job, sequence) if of_job == job_id else None
    if row is None:
        raise NotFound(f"job {job_id!r} has no task {task_id!r}")
    return row


def page_frames(session: Session, job_id: str, *, cursor: str | None, limit: int) -> frame_schema.FramePage:
    """Return frames of a job in order."""
    row = find_job(session, job_id)
    numbers = show.spec_of(row).frame_numbers
    start = bisect_right(numbers, number_in(cursor))
    shown = numbers[start : start + limit]
    standing: dict[int, set[tuple[TaskKind, TaskStatus]]] = defaultdict(set)
    for number, kind, status, _ in task_rows.frames(session, job_id, shown):
        if number is not None:
            standing[number].add((kind, status))
    items = tuple(_frame(job_id, number, frame_status(standing[number], row.status)) for number in shown)
    more = start + limit < len(numbers)
    return frame_schema.FramePage(items=items, next_cursor=str(shown[-1]) if more else None)


def number_in(cursor: str | None) -> int:
    """Return the number that a cursor holds, -1 for none.

    Raises
    ------
    Invalid
        If it holds none.
    """
    if cursor is None:
        return -1
    if not (cursor.isascii() and cursor.isdigit() and len(cursor) <= 18):
        problem = FieldProblem(field="cursor", expected="a next_cursor of the page before", got=repr(cursor))
        raise Invalid(str(problem), problems=[problem])
    return int(cursor)


def _frame(job_id: str, number: int, status: FrameStatus) -> frame_schema.Frame:
    def url(name: str) -> str | None:
        return show.artifact_url(job_id, name) if status is FrameStatus.DONE else None

    return frame_schema.Frame(
        frame=number,
        status=status,
        thumb=url(names.thumb_name(number)),
        integral=url(names.integral_name(number)),
        orthoscopic=url(names.orthoscopic_name(number)),
        views=url(names.views_name(number)),
    )
