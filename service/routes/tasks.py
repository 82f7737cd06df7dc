"""Tasks of a job, their logs and actions, and frames."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

from fastapi import APIRouter, Path, Query
from fastapi.responses import StreamingResponse
from sqlalchemy.orm import Session

from lippmann.job.animation.frames import MAX_FRAME_NUMBER
from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import TaskStatus
from service.api import listings
from service.api.artifact_files import find_log
from service.audit import record
from service.auth import Caller
from service.db.tables import Task as TaskRow
from service.dependencies import (
    AppState,
    AppStateDep,
    CursorQuery,
    JobId,
    LimitQuery,
    OwnJobId,
    SubmitterDep,
    ViewerDep,
)
from service.jobs.task_commands import end_task, restart_task
from service.routes.description import problems
from service.schemas.access import AuditAction
from service.schemas.frame import FramePage, FrameStatuses
from service.schemas.task import AttemptList, Task, TaskPage

router = APIRouter(prefix="/jobs/{job_id}", tags=["tasks"])

MAX_ATTEMPT = 1_000_000
"""The greatest number of an attempt that can be asked for."""

TaskId = Annotated[str, Path(description="The id of the task.")]


@router.get("/tasks")
def list_tasks(
    job_id: JobId,
    state: AppStateDep,
    _caller: ViewerDep,
    limit: LimitQuery = 100,
    cursor: CursorQuery = None,
    status: Annotated[TaskStatus | None, Query(description="List only tasks with this status.")] = None,
    kind: Annotated[TaskKind | None, Query(description="List only tasks of this kind.")] = None,
    frame: Annotated[
        int | None, Query(ge=1, le=MAX_FRAME_NUMBER, description="List only tasks of the frame of this number.")
    ] = None,
) -> TaskPage:
    """List the tasks of a job in order."""
    outlook = state.outlook()
    with state.database.reading() as session:
        return listings.page_tasks(
            session, job_id, outlook, status=status, kind=kind, frame=frame, cursor=cursor, limit=limit
        )


@router.get("/attempts")
def list_attempts(job_id: JobId, state: AppStateDep, _caller: ViewerDep, limit: LimitQuery = 100) -> AttemptList:
    """List the attempts of the tasks of a job with what became of them, the one that began last first."""
    with state.database.reading() as session:
        return listings.list_attempts(session, job_id, limit=limit)


@router.get("/tasks/{task_id}")
def get_task(job_id: JobId, task_id: TaskId, state: AppStateDep, _caller: ViewerDep) -> Task:
    """Get a task."""
    outlook = state.outlook()
    with state.database.reading() as session:
        return listings.get_task(session, job_id, task_id, outlook)


@router.get("/tasks/{task_id}/log", response_class=StreamingResponse, responses={200: {"content": {"text/plain": {}}}})
def get_log(
    job_id: JobId,
    task_id: TaskId,
    state: AppStateDep,
    _caller: ViewerDep,
    attempt: Annotated[
        int | None,
        Query(ge=1, le=MAX_ATTEMPT, description="The number of the attempt, by default the latest one with a log."),
    ] = None,
) -> StreamingResponse:
    """Get the log of an attempt."""
    store = state.parts.store
    with state.database.reading() as session:
        name = find_log(session, store, job_id, task_id, attempt=attempt)
    headers = {"X-Content-Type-Options": "nosniff", "Cache-Control": "private, no-cache"}
    chunks = store.read_range(name, 0, store.size(name))
    return StreamingResponse(chunks, media_type="text/plain; charset=utf-8", headers=headers)


@router.post("/tasks/{task_id}/restart", responses=problems(409))
def restart(job_id: OwnJobId, task_id: TaskId, state: AppStateDep, caller: SubmitterDep) -> Task:
    """Stop the attempt that owns a task. The task runs again, on another worker if there is one."""

    def run(session: Session, task: TaskRow) -> None:
        restart_task(session, task, now_s=state.now_s())

    return _command(state, caller, AuditAction.RESTART_TASK, job_id, task_id, run)


@router.post("/tasks/{task_id}/end", responses=problems(409))
def end(job_id: OwnJobId, task_id: TaskId, state: AppStateDep, caller: SubmitterDep) -> Task:
    """End a running task for good. Its job fails, or only the output that it makes; skip and retry go on from there."""

    def run(session: Session, task: TaskRow) -> None:
        end_task(session, task, by=caller.name, now_s=state.now_s(), limit=state.settings.failure_limit)

    return _command(state, caller, AuditAction.END_TASK, job_id, task_id, run)


@router.get("/frames/statuses")
def list_frame_statuses(job_id: JobId, state: AppStateDep, _caller: ViewerDep) -> FrameStatuses:
    """Get the statuses of all frames of a job at once."""
    with state.database.reading() as session:
        return listings.frame_statuses(session, job_id)


@router.get("/frames")
def list_frames(
    job_id: JobId, state: AppStateDep, _caller: ViewerDep, limit: LimitQuery = 100, cursor: CursorQuery = None
) -> FramePage:
    """List the frames of a job in order."""
    with state.database.reading() as session:
        return listings.page_frames(session, job_id, cursor=cursor, limit=limit)


def _command(
    state: AppState,
    caller: Caller,
    action: AuditAction,
    job_id: str,
    task_id: str,
    run: Callable[[Session, TaskRow], None],
) -> Task:
    outlook = state.outlook()

    def work(session: Session) -> Task:
        run(session, listings.find_task(session, job_id, task_id))
        record(session, caller, action, task_id, now_s=state.now_s())
        return listings.get_task(session, job_id, task_id, outlook)

    found = state.database.write_in_reserve(work)
    state.wakeup.notify()
    return found
