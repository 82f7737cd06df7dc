"""The stream of server-sent events."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from contextlib import AbstractContextManager, aclosing, nullcontext
from typing import Annotated, Any, cast

from fastapi import APIRouter, Header, Query
from fastapi.responses import StreamingResponse
from starlette.concurrency import run_in_threadpool
from starlette.types import Receive, Scope, Send

from service.api.listings import number_in
from service.auth import Caller
from service.dependencies import AppState, AppStateDep, JobId, ScopeDep, ViewerDep, check_visible
from service.jobs.state_machine import find_job
from service.routes.description import Responses, problems
from service.schemas.events import StreamMessage

router = APIRouter(tags=["events"])


class EventStream(StreamingResponse):
    """A stream of server-sent events."""

    media_type = "text/event-stream"
    counted: AbstractContextManager[None] = nullcontext()
    """Counts the stream while it is open; refuses it if there are too many."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the stream, which counts from its request on."""
        with self.counted:
            await super().__call__(scope, receive, send)

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
    position = number_in(last_event_id) if last_event_id else None
    events = state.hub.stream(job_id=job_id, caller_id=caller.id, position=position, owner_id=owner_id)
    stream = EventStream(events, headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"})
    stream.counted = state.hub.counted(caller.id, most=state.settings.streams_per_key)
    return stream


def _check_job(state: AppState, job_id: str) -> None:
    with state.database.reading() as session:
        find_job(session, job_id)
