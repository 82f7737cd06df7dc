"""What happens, as it happens: server-sent events."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Header, Query
from fastapi.responses import StreamingResponse
from starlette.concurrency import run_in_threadpool

from service.api.listings import number_in
from service.auth import Caller, is_good
from service.dependencies import House, HouseDep, ViewerDep
from service.events.sse import listen
from service.jobs.state_machine import find_job

router = APIRouter(tags=["events"])

_Responses = dict[int | str, dict[str, Any]]
_STREAM: _Responses = {200: {"content": {"text/event-stream": {}}, "description": "job, task, frame, progress."}}
LastEventId = Annotated[str | None, Header(alias="Last-Event-ID", description="Go on after this event.")]


@router.get("/events", response_class=StreamingResponse, responses=_STREAM)
async def listen_to_farm(
    house: HouseDep,
    caller: ViewerDep,
    job: Annotated[str | None, Query(description="Only of this job.")] = None,
    last_event_id: LastEventId = None,
) -> StreamingResponse:
    """Listen to everything, or to one job."""
    return await _listen(house, caller, job, last_event_id)


@router.get("/jobs/{job_id}/events", response_class=StreamingResponse, responses=_STREAM)
async def listen_to_job(
    job_id: str, house: HouseDep, caller: ViewerDep, last_event_id: LastEventId = None
) -> StreamingResponse:
    """Listen to one job."""
    return await _listen(house, caller, job_id, last_event_id)


async def _listen(house: House, caller: Caller, job_id: str | None, last_event_id: str | None) -> StreamingResponse:
    if job_id is not None:
        await run_in_threadpool(_check, house, job_id)
    position = number_in(last_event_id) if last_event_id else None
    events = listen(
        house.database,
        house.bell,
        job_id=job_id,
        position=position,
        keepalive_s=house.settings.keepalive_s,
        may_listen=lambda: _is_good(house, caller),
    )
    headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
    return StreamingResponse(events, media_type="text/event-stream", headers=headers)


def _is_good(house: House, caller: Caller) -> bool:
    with house.database.reading() as session:
        return is_good(session, caller, now_s=house.now_s())


def _check(house: House, job_id: str) -> None:
    with house.database.reading() as session:
        find_job(session, job_id)
