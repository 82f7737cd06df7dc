"""Pages of jobs, tasks and frames. A cursor is the item after which the next page begins."""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterator, Sequence
from functools import cache, partial

from sqlalchemy.orm import Session

from lippmann.errors import FieldProblem
from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import FrameStatus, TaskStatus, frame_status
from lippmann.plan import artifact_names as names
from service.api.presenters import present_attempt, present_jobs, present_task
from service.api.waits import Outlook, task_waits
from service.db import access as access_rows
from service.db import attempts as attempt_rows
from service.db import job_pages, overview
from service.db import tasks as task_rows
from service.db.job_pages import JobQuery, cursor_of, parse_position
from service.db.tables import Task
from service.errors import Invalid, NotFound
from service.ids import parse_task_id
from service.jobs.state_machine import find_job
from service.schemas import access as access_schema
from service.schemas import frame as frame_schema
from service.schemas import job as job_schema
from service.schemas import task as task_schema
from service.schemas.answer import utc
from service.schemas.links import artifact_url


def page_jobs(
    session: Session, query: JobQuery, outlook: Outlook, *, cursor: str | None, offset: int, limit: int, counted: bool
) -> job_schema.JobPage:
    """Return a page of jobs in order, after a job or after a number of jobs.

    Raises
    ------
    Invalid
        If the cursor is not of this order, or if there is an offset too.
    """
    after = None
    if cursor is not None:
        after = parse_position(cursor, query.sort)
        if after is None or offset:
            expected = "no cursor beside an offset" if offset else "the next_cursor of the page before in this order"
            problem = FieldProblem(field="cursor", expected=expected, got=repr(cursor))
            raise Invalid(str(problem), problems=[problem])
    rows = job_pages.page(session, query, after=after, offset=offset, limit=limit + 1)
    kept = rows[:limit]
    items = present_jobs(session, kept, outlook)
    is_last = len(rows) <= limit
    return job_schema.JobPage(
        items=items,
        next_cursor=None if is_last else cursor_of(job_pages.position_of(session, query, kept[-1]), query.sort),
        total=job_pages.count(session, query) if counted else None,
    )


def page_tasks(
    session: Session,
    job_id: str,
    outlook: Outlook,
    *,
    status: TaskStatus | None,
    kind: TaskKind | None,
    frame: int | None = None,
    cursor: str | None,
    limit: int,
) -> task_schema.TaskPage:
    """Return a page of the tasks of a job, in order."""
    job = find_job(session, job_id)
    rows = task_rows.page(
        session, job_id, status=status, kind=kind, frame=frame, after=number_in(cursor), limit=limit + 1
    )
    kept = rows[:limit]
    waits = task_waits(session, job, kept, outlook)
    items = tuple(present_task(row, waits.get(row.sequence)) for row in kept)
    return task_schema.TaskPage(items=items, next_cursor=str(kept[-1].sequence) if len(rows) > limit else None)


def get_task(session: Session, job_id: str, task_id: str, outlook: Outlook) -> task_schema.Task:
    """Return a task of a job as the API returns it.

    Raises
    ------
    NotFound
        If the job has no task of this id.
    """
    row = find_task(session, job_id, task_id)
    waits = task_waits(session, find_job(session, job_id), [row], outlook)
    return present_task(row, waits.get(row.sequence))


def find_task(session: Session, job_id: str, task_id: str) -> Task:
    """Return a task of a job.

    Raises
    ------
    NotFound
        If the job has no task of this id.
    """
    find_job(session, job_id)
    of_job, sequence = parse_task_id(task_id)
    row = task_rows.task(session, of_job, sequence) if of_job == job_id else None
    if row is None:
        raise NotFound(f"job {job_id!r} has no task {task_id!r}")
    return row


def page_frames(session: Session, job_id: str, *, cursor: str | None, limit: int) -> frame_schema.FramePage:
    """Return a page of the frames of a job, in order."""
    row = find_job(session, job_id)
    numbers = row.parsed_spec.frame_numbers
    start = bisect_right(numbers, number_in(cursor))
    page = numbers[start : start + limit]
    statuses: dict[int, set[tuple[TaskKind, TaskStatus]]] = defaultdict(set)
    for number, kind, status, _ in task_rows.frames(session, job_id, page):
        if number is not None:
            statuses[number].add((kind, status))
    items = tuple(_frame(job_id, number, frame_status(statuses[number], row.status)) for number in page)
    more = start + limit < len(numbers)
    return frame_schema.FramePage(items=items, next_cursor=str(page[-1]) if more else None)


def list_attempts(session: Session, job_id: str, *, limit: int) -> task_schema.AttemptList:
    """Return the attempts of the tasks of a job, the one that began last first."""
    find_job(session, job_id)
    ended = {(row.sequence, row.number): (row, task) for row, task in attempt_rows.ended(session, job_id, limit=limit)}
    items = [present_attempt(task, row) for row, task in ended.values()]
    latest = attempt_rows.latest(session, job_id, limit=limit)
    items += [present_attempt(row) for row in latest if (row.sequence, row.attempt_number) not in ended]
    items.sort(key=lambda item: (item.started_at, item.task, item.number), reverse=True)
    total = len(items) if len(items) < limit else attempt_rows.count(session, job_id)
    return task_schema.AttemptList(items=tuple(items[:limit]), total=total)


def frame_statuses(session: Session, job_id: str) -> frame_schema.FrameStatuses:
    """Return the statuses of all frames of a job, in order."""
    row = find_job(session, job_id)
    tasks: dict[int, set[tuple[TaskKind, TaskStatus]]] = defaultdict(set)
    for number, kind, status in overview.all_frames(session, job_id):
        tasks[number].add((kind, status))
    # Most frames have tasks in the same few statuses.
    status_of = cache(partial(frame_status, job=row.status))
    statuses = [(number, status_of(frozenset(tasks[number]))) for number in row.parsed_spec.frame_numbers]
    return frame_schema.FrameStatuses(runs=tuple(runs_of(statuses)))


def runs_of(statuses: Sequence[tuple[int, FrameStatus]]) -> Iterator[frame_schema.FrameRun]:
    """Join frames that follow each other in the same step with the same status.

    >>> [(run.first, run.last, run.step) for run in runs_of([(n, FrameStatus.DONE) for n in (1, 3, 5, 9)])]
    [(1, 5, 2), (9, 9, 1)]
    """
    start = 0
    while start < len(statuses):
        first, status = statuses[start]
        step = statuses[start + 1][0] - first if start + 1 < len(statuses) else 1
        stop = start + 1
        while stop < len(statuses) and statuses[stop] == (statuses[stop - 1][0] + step, status):
            stop += 1
        is_single = stop == start + 1
        yield frame_schema.FrameRun(
            status=status, first=first, last=statuses[stop - 1][0], step=1 if is_single else step
        )
        start = stop


def page_audit(
    session: Session,
    *,
    cursor: str | None,
    limit: int,
    action: access_schema.AuditAction | None = None,
    name: str | None = None,
    subject: str | None = None,
) -> access_schema.AuditPage:
    """Return a page of the audit log, newest first, only the entries of an action, a key and a subject if given."""
    before = None if cursor is None else number_in(cursor)
    rows = access_rows.audit_page(session, before=before, limit=limit + 1, action=action, name=name, subject=subject)
    kept = rows[:limit]
    items = tuple(
        access_schema.AuditEntry(
            id=row.id,
            at=utc(row.at_s),
            key_id=row.key_id,
            name=row.name,
            role=access_schema.Role(row.role),
            action=access_schema.AuditAction(row.action),
            subject=row.subject,
            detail=row.detail,
            address=row.address,
            request_id=row.request_id,
        )
        for row in kept
    )
    return access_schema.AuditPage(items=items, next_cursor=str(kept[-1].id) if len(rows) > limit else None)


def number_in(cursor: str | None) -> int:
    """Return the number in a cursor, -1 without a cursor.

    Raises
    ------
    Invalid
        If the cursor is no number.
    """
    if cursor is None:
        return -1
    if not (cursor.isascii() and cursor.isdigit() and len(cursor) <= 18):
        problem = FieldProblem(field="cursor", expected="the next_cursor of the page before", got=repr(cursor))
        raise Invalid(str(problem), problems=[problem])
    return int(cursor)


def _frame(job_id: str, number: int, status: FrameStatus) -> frame_schema.Frame:
    def url(name: str) -> str | None:
        return artifact_url(job_id, name) if status is FrameStatus.DONE else None

    return frame_schema.Frame(
        frame=number,
        status=status,
        thumb=url(names.thumb_name(number)),
        integral=url(names.integral_name(number)),
        orthoscopic=url(names.orthoscopic_name(number)),
        views=url(names.views_name(number)),
    )
