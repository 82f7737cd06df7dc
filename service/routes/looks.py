"""Look into a frame: views, what an eye sees, another focus, all views at once; made when they are asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import anyio
from fastapi import APIRouter, Depends, Header, Query
from fastapi.responses import Response

from service.api.artifact_files import is_fresh
from service.dependencies import HouseDep, ViewerDep
from service.routes.artifacts import CONVERSIONS
from service.schemas.look import AtlasQuery, Look, ObserverQuery, PerspectiveQuery, RefocusQuery, ViewQuery
from service.viewing import frames as look
from service.viewing.frames import See, Sight

router = APIRouter(prefix="/jobs/{job_id}/frames/{frame}", tags=["looks"])

_PICTURE: dict[int | str, dict[str, Any]] = {200: {"content": {"image/png": {}, "image/webp": {}}}}


def find_sight(job_id: str, frame: int, house: HouseDep, _caller: ViewerDep) -> Sight:
    """Return the frame that somebody looks into."""
    # Given back at once: a slow store holds no connection.
    with house.database.reading() as session:
        return look.find_sight(session, house.parts, job_id, frame)


SightDep = Annotated[Sight, Depends(find_sight)]


@dataclass(frozen=True)
class Asking:
    """What every request for a picture comes with."""

    house: HouseDep
    sight: SightDep
    if_none_match: Annotated[str | None, Header(include_in_schema=False)] = None


AskingDep = Annotated[Asking, Depends()]


@router.get("/look")
def describe(
    job_id: str,
    sight: SightDep,
    max_px: Annotated[int, Query(ge=16, le=16_384, description="The longest side of the atlas.")] = 4096,
) -> Look:
    """Tell which views a frame has, and how they lie in its atlas."""
    return look.describe(sight, job_id, max_px=max_px)


@router.get("/view", response_class=Response, responses=_PICTURE)
async def view(query: Annotated[ViewQuery, Query()], asking: AskingDep) -> Response:
    """Show one view, one pixel a lens."""
    return await _seen(asking, "view", query, look.see_view)


@router.get("/perspective", response_class=Response, responses=_PICTURE)
async def perspective(query: Annotated[PerspectiveQuery, Query()], asking: AskingDep) -> Response:
    """Show what an eye sees that stands somewhere, one pixel a lens; lenses without light for it are dark."""
    return await _seen(asking, "perspective", query, look.see_from)


@router.get("/refocus", response_class=Response, responses=_PICTURE)
async def refocus(query: Annotated[RefocusQuery, Query()], asking: AskingDep) -> Response:
    """Show the picture that is sharp at a depth."""
    return await _seen(asking, "refocus", query, look.see_focused)


@router.get("/observer", response_class=Response, responses=_PICTURE)
async def observer(query: Annotated[ObserverQuery, Query()], asking: AskingDep) -> Response:
    """Show what one eye or two see of the display, by rays through pupil and lenses, with its crosstalk and blur."""
    return await _seen(asking, "observer", query, look.see_observed)


@router.get("/views.atlas", response_class=Response, responses=_PICTURE)
async def atlas(query: Annotated[AtlasQuery, Query()], asking: AskingDep) -> Response:
    """Give the views as one picture for a graphics card; `look` says how they lie in it."""
    return await _seen(asking, "views.atlas", query, look.see_atlas)


async def _seen(asking: Asking, what: str, query: Any, see: See) -> Response:
    house, sight = asking.house, asking.sight
    etag = look.etag_of(sight, what, query)
    headers = {"ETag": etag, "Cache-Control": "private, no-cache", "X-Content-Type-Options": "nosniff"}
    if is_fresh(asking.if_none_match, etag):
        return Response(status_code=304, headers=headers)
    make = partial(look.picture, house.parts, house.sheets, sight, query, see)
    data = await anyio.to_thread.run_sync(make, limiter=CONVERSIONS)
    return Response(data, headers=headers, media_type=f"image/{query.format}")
