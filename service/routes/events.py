"""The stream of server-sent events."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from contextlib import aclosing
from typing import Annotated, Any, cast

from fastapi import APIRouter, Header, Query
from fastapi.responses import StreamingResponse
from starlette.concurrency import run_in_threadpool
from starlette.types import Send

from service.api.listings import number_in
from service.auth import Caller
from service.dependencies import AppState, AppStateDep, JobId, ScopeDep, ViewerDep, check_visible
from service.errors import TooManyRequests
from service.jobs.state_machine import find_job
from service.routes.description import Responses, problems
from service.schemas.events import StreamMessage

router = APIRouter(tags=["events"])

STREAM_RETRY_S = 30.0
"""The time after which a client with too many streams may try again."""


class EventStream(StreamingResponse):
    """A stream of server-sent events."""

    media_type = "text/event-stream"

    async def stream_response(self, send: Send) -> None:
        """Send the stream, and leave the hub at once when the client disconnects."""
        async with aclosing(cast(AsyncGenerator[Any], self.body_iterator)):
            await super().stream_response(send)


_STREAM: Responses = {200: {"model": StreamMessage, "description": "The schema describes one event of the stream."}}
LastEventId = Annotated[
    str | None,
    Header(
        alias="Last-Event-ID",
        description="Send the events after this one; without it, first the present state of the job, then new events.",
    ),
]


@router.get("/events", response_class=EventStream, responses=_STREAM | problems(404))
async def subscribe_to_farm(
    state: AppStateDep,
    caller: ViewerDep,
    scope: ScopeDep,
    job: Annotated[str | None, Query(description="Send only the events of this job.")] = None,
    last_event_id: LastEventId = None,
) -> EventStream:
    """Subscribe to the events of all jobs or of one."""
    if job is not None:
        await run_in_threadpool(check_visible, state, job, scope)
    return await _subscribe(state, caller, job, last_event_id, scope)


@router.get("/jobs/{job_id}/events", response_class=EventStream, responses=_STREAM)
async def subscribe_to_job(
    job_id: JobId, state: AppStateDep, caller: ViewerDep, scope: ScopeDep, last_event_id: LastEventId = None
) -> EventStream:
    """Subscribe to the events of one job."""
    return await _subscribe(state, caller, job_id, last_event_id, scope)


async def _subscribe(
    state: AppState, caller: Caller, job_id: str | None, last_event_id: str | None, owner_id: str | None
) -> EventStream:
    if job_id is not None:
        await run_in_threadpool(_check_job, state, job_id)
    if state.hub.streams_of(caller.id) >= state.settings.streams_per_key:
        raise TooManyRequests("the key has too many open event streams", retry_after_s=STREAM_RETRY_S)
    position = number_in(last_event_id) if last_event_id else None
    events = state.hub.stream(job_id=job_id, caller_id=caller.id, position=position, owner_id=owner_id)
    return EventStream(events, headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"})


def _check_job(state: AppState, job_id: str) -> None:
    with state.database.reading() as session:
        find_job(session, job_id)
