"""The stream of server-sent events."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Header, Query
from fastapi.responses import StreamingResponse
from starlette.concurrency import run_in_threadpool

from service.api.listings import number_in
from service.auth import Caller, is_valid
from service.dependencies import AppState, AppStateDep, ViewerDep
from service.events.sse import stream_events
from service.jobs.state_machine import find_job
from service.routes.jobs import JobId
from service.schemas.events import StreamMessage

router = APIRouter(tags=["events"])


class EventStream(StreamingResponse):
    """A stream of server-sent events."""

    media_type = "text/event-stream"


_Responses = dict[int | str, dict[str, Any]]
_STREAM: _Responses = {200: {"model": StreamMessage, "description": "The schema describes one event of the stream."}}
LastEventId = Annotated[
    str | None,
    Header(
        alias="Last-Event-ID",
        description="Send the events after this one; without it, first the present state of the job, then new events.",
    ),
]


@router.get("/events", response_class=EventStream, responses=_STREAM)
async def subscribe_to_farm(
    state: AppStateDep,
    caller: ViewerDep,
    job: Annotated[str | None, Query(description="Send only the events of this job.")] = None,
    last_event_id: LastEventId = None,
) -> EventStream:
    """Subscribe to the events of all jobs or of one."""
    return await _subscribe(state, caller, job, last_event_id)


@router.get("/jobs/{job_id}/events", response_class=EventStream, responses=_STREAM)
async def subscribe_to_job(
    job_id: JobId, state: AppStateDep, caller: ViewerDep, last_event_id: LastEventId = None
) -> EventStream:
    """Subscribe to the events of one job."""
    return await _subscribe(state, caller, job_id, last_event_id)


async def _subscribe(state: AppState, caller: Caller, job_id: str | None, last_event_id: str | None) -> EventStream:
    if job_id is not None:
        await run_in_threadpool(_check_job, state, job_id)
    position = number_in(last_event_id) if last_event_id else None
    events = stream_events(
        state.database,
        state.wakeup,
        job_id=job_id,
        position=position,
        keepalive_s=state.settings.keepalive_s,
        is_authorized=lambda: _is_authorized(state, caller),
    )
    return EventStream(events, headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"})


def _is_authorized(state: AppState, caller: Caller) -> bool:
    with state.database.reading() as session:
        return is_valid(session, caller, now_s=state.now_s())


def _check_job(state: AppState, job_id: str) -> None:
    with state.database.reading() as session:
        find_job(session, job_id)
