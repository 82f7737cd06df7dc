"""The figures of the farm, for Prometheus and for autoscalers."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Cookie, Depends, Header, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from lippmann.job.rendering.engines import Engine
from lippmann.job.rendering.workers import ENGINE_TITLES
from service.db import farm as farm_rows
from service.dependencies import AppStateDep, get_caller_or_none, identify_caller, require_viewer
from service.metrics.scrape import MEDIA_TYPE, scrape_text
from service.metrics.waiting import waiting_work, waiting_work_for
from service.query_names import check_query
from service.routes.middleware import address_of
from service.schemas.farm import WaitingWork

MOST_MB = 100_000_000
"""The largest memory of a task, MB, as in `lippmann.job.rendering.workers`."""

router = APIRouter()
api = APIRouter(tags=["farm"])


async def admit_monitor(
    request: Request,
    state: AppStateDep,
    authorization: Annotated[str | None, Header(include_in_schema=False)] = None,
    lippmann_session: Annotated[str | None, Cookie(include_in_schema=False)] = None,
) -> None:
    """Let programs in that watch the farm, and everybody with a key.

    Raises
    ------
    Unauthorized
        If there is no key, and neither the token of monitors nor an address that the operator has listed.
    Invalid
        If the query has parameters that the route does not have.
    """
    is_forwarded = "x-forwarded-for" in request.headers or "forwarded" in request.headers
    if state.monitors.admits(address=address_of(request), is_forwarded=is_forwarded, authorization=authorization):
        await check_query(request)
        return
    caller = await identify_caller(request, state, authorization, None, lippmann_session)
    await require_viewer(await get_caller_or_none(request, state, caller))


MonitorDep = Depends(admit_monitor)


@router.get("/metrics", dependencies=[MonitorDep])
async def get_metrics(state: AppStateDep) -> Response:
    """Get the figures of this process and of the farm in the text format of Prometheus."""
    reading = await state.farm_reader.read(now_s=state.now_s())
    text = await run_in_threadpool(scrape_text, reading, state.settings, streams=state.hub.streams)
    return Response(text, media_type=MEDIA_TYPE)


@api.get("/waiting", dependencies=[MonitorDep])
def get_waiting_work(
    state: AppStateDep,
    pool: Annotated[
        str | None, Query(max_length=64, description="Only the work that a worker of this pool may do; empty for none.")
    ] = None,
    tag: Annotated[list[str] | None, Query(max_length=64, description="A tag of this worker.")] = None,
    memory_mb: Annotated[int | None, Query(ge=1, le=MOST_MB, description="Its memory for a task, MB.")] = None,
    engine: Annotated[
        list[Engine] | None, Query(max_length=8, description="An engine of this worker; all engines without one.")
    ] = None,
) -> WaitingWork:
    """Get the work that waits for slots, for an autoscaler of workers. It is as the database has it now."""
    max_slots = state.settings.max_slots
    with state.database.reading() as session:
        rows = farm_rows.wanted(session)
    if pool is None and tag is None and memory_mb is None and engine is None:
        return waiting_work(rows, max_slots=max_slots)
    engines = ENGINE_TITLES if engine is None else engine
    return waiting_work_for(
        rows, max_slots=max_slots, pool=pool or "", tags=tag or (), memory_mb=memory_mb, engines=engines
    )
