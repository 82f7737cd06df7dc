"""Tasks of a job, their logs, and frames."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from fastapi.responses import StreamingResponse

from lippmann.job.orders import TaskKind
from lippmann.job.states import TaskStatus
from service.api import listings as browse
from service.api import presenters as show
from service.api.logs import find_log
from service.dependencies import CursorQuery, HouseDep, LimitQuery, SessionDep, ViewerDep
from service.schemas.frame import FramePage
from service.schemas.task import Task, TaskPage

router = APIRouter(prefix="/jobs/{job_id}", tags=["tasks"])


@router.get("/tasks")
def list_tasks(
    job_id: str,
    session: SessionDep,
    _caller: ViewerDep,
    limit: LimitQuery = 100,
    cursor: CursorQuery = None,
    status: TaskStatus | None = None,
    kind: TaskKind | None = None,
) -> TaskPage:
    """List tasks of a job in order."""
    return browse.page_tasks(session, job_id, status=status, kind=kind, cursor=cursor, limit=limit)


@router.get("/tasks/{task_id}")
def show_task(job_id: str, task_id: str, session: SessionDep, _caller: ViewerDep) -> Task:
    """Show a task."""
    return show.show_task(browse.find_task(session, job_id, task_id))


@router.get("/tasks/{task_id}/log", response_class=StreamingResponse, responses={200: {"content": {"text/plain": {}}}})
def show_log(
    job_id: str,
    task_id: str,
    session: SessionDep,
    house: HouseDep,
    _caller: ViewerDep,
    attempt: Annotated[int | None, Query(ge=1, description="The latest that left one when not said.")] = None,
) -> StreamingResponse:
    """Show the log of an attempt."""
    store = house.parts.store
    name = find_log(session, store, job_id, task_id, attempt=attempt)
    headers = {"X-Content-Type-Options": "nosniff", "Cache-Control": "private, no-cache"}
    chunks = store.read_range(name, 0, store.size(name))
    return StreamingResponse(chunks, media_type="text/plain; charset=utf-8", headers=headers)


@router.get("/frames")
def list_frames(
    job_id: str, session: SessionDep, _caller: ViewerDep, limit: LimitQuery = 100, cursor: CursorQuery = None
) -> FramePage:
    """List frames of a job in order."""
    return browse.page_frames(session, job_id, cursor=cursor, limit=limit)
