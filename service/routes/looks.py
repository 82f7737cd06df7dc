"""Look into a frame: views, what an eye sees, another focus, all views at once; made when they are asked for."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

import anyio
from fastapi import APIRouter, Header, Query
from fastapi.responses import Response

from service.dependencies import House, HouseDep, ViewerDep
from service.jobs import look
from service.jobs.artifacts import is_fresh
from service.jobs.look import See, Sight
from service.routes.artifacts import CONVERSIONS
from service.schemas.look import AtlasQuery, Look, ObserverQuery, PerspectiveQuery, RefocusQuery, ViewQuery

router = APIRouter(prefix="/jobs/{job_id}/frames/{frame}", tags=["looks"])

IfNoneMatch = Annotated[str | None, Header(include_in_schema=False)]
_PICTURE: dict[int | str, dict[str, Any]] = {200: {"content": {"image/png": {}, "image/webp": {}}}}


@router.get("/look")
def describe(
    job_id: str,
    frame: int,
    house: HouseDep,
    _caller: ViewerDep,
    max_px: Annotated[int, Query(ge=16, le=16_384, description="The longest side of the atlas.")] = 4096,
) -> Look:
    """Tell which views a frame has, and how they lie in its atlas."""
    return look.describe(_sight(house, job_id, frame), job_id, max_px=max_px)


@router.get("/view", response_class=Response, responses=_PICTURE)
async def view(
    job_id: str,
    frame: int,
    query: Annotated[ViewQuery, Query()],
    house: HouseDep,
    _caller: ViewerDep,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Show one view, one pixel a lens."""
    return await _seen(house, job_id, frame, "view", query, look.see_view, if_none_match)


@router.get("/perspective", response_class=Response, responses=_PICTURE)
async def perspective(
    job_id: str,
    frame: int,
    query: Annotated[PerspectiveQuery, Query()],
    house: HouseDep,
    _caller: ViewerDep,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Show what an eye sees that stands somewhere, one pixel a lens; lenses without light for it are dark."""
    return await _seen(house, job_id, frame, "perspective", query, look.see_from, if_none_match)


@router.get("/refocus", response_class=Response, responses=_PICTURE)
async def refocus(
    job_id: str,
    frame: int,
    query: Annotated[RefocusQuery, Query()],
    house: HouseDep,
    _caller: ViewerDep,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Show the picture that is sharp at a depth."""
    return await _seen(house, job_id, frame, "refocus", query, look.see_focused, if_none_match)


@router.get("/observer", response_class=Response, responses=_PICTURE)
async def observer(
    job_id: str,
    frame: int,
    query: Annotated[ObserverQuery, Query()],
    house: HouseDep,
    _caller: ViewerDep,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Show what one eye or two see of the display, by rays through pupil and lenses, with its crosstalk and blur."""
    return await _seen(house, job_id, frame, "observer", query, look.see_observed, if_none_match)


@router.get("/views.atlas", response_class=Response, responses=_PICTURE)
async def atlas(
    job_id: str,
    frame: int,
    query: Annotated[AtlasQuery, Query()],
    house: HouseDep,
    _caller: ViewerDep,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Give the views as one picture for a graphics card; `look` says how they lie in it."""
    return await _seen(house, job_id, frame, "views.atlas", query, look.see_atlas, if_none_match)


def _sight(house: House, job_id: str, frame: int) -> Sight:
    # Given back at once: a slow store holds no connection.
    with house.database.reading() as session:
        return look.find_sight(session, house.parts, job_id, frame)


async def _seen(
    house: House, job_id: str, frame: int, what: str, query: Any, see: See, if_none_match: str | None
) -> Response:
    sight = await anyio.to_thread.run_sync(_sight, house, job_id, frame)
    etag = look.etag_of(sight, what, query)
    headers = {"ETag": etag, "Cache-Control": "private, no-cache", "X-Content-Type-Options": "nosniff"}
    if is_fresh(if_none_match, etag):
        return Response(status_code=304, headers=headers)
    make = partial(look.picture, house.parts, house.sheets, sight, query, see)
    data = await anyio.to_thread.run_sync(make, limiter=CONVERSIONS)
    return Response(data, headers=headers, media_type=f"image/{query.format}")
