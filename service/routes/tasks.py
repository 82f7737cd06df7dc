"""Tasks of a job, their logs, and frames."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query
from fastapi.responses import StreamingResponse

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import TaskStatus
from service.api import listings
from service.api.artifact_files import find_log
from service.dependencies import AppStateDep, CursorQuery, JobId, LimitQuery, ViewerDep
from service.schemas.frame import FramePage
from service.schemas.task import Task, TaskPage

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
) -> TaskPage:
    """List the tasks of a job in order."""
    outlook = state.outlook()
    with state.database.reading() as session:
        return listings.page_tasks(session, job_id, outlook, status=status, kind=kind, cursor=cursor, limit=limit)


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


@router.get("/frames")
def list_frames(
    job_id: JobId, state: AppStateDep, _caller: ViewerDep, limit: LimitQuery = 100, cursor: CursorQuery = None
) -> FramePage:
    """List the frames of a job in order."""
    with state.database.reading() as session:
        return listings.page_frames(session, job_id, cursor=cursor, limit=limit)
