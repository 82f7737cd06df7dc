"""Views of a frame on demand: single views, perspectives, refocusing, an observer, all views as an atlas; depths."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Path, Query
from fastapi.responses import Response

from lippmann.job.animation.frames import MAX_FRAME_NUMBER
from lippmann.plan import artifact_names as names
from service.api.artifact_files import is_fresh
from service.dependencies import AppStateDep, JobId, ViewerDep
from service.limits import Limits
from service.routes.description import NOT_CHANGED, Responses
from service.schemas.viewing import (
    AtlasQuery,
    DepthMapQuery,
    FocusDepth,
    FocusQuery,
    FrameViews,
    ObserverQuery,
    PerspectiveQuery,
    RefocusQuery,
    ViewQuery,
)
from service.viewing import depth, frames, render
from service.viewing.viewable_frame import ViewableFrame

router = APIRouter(prefix="/jobs/{job_id}/frames/{frame}", tags=["viewing"])

_MEDIA_TYPES = {"png": "image/png", "webp": "image/webp", "exr": "image/x-exr"}
_PICTURE: Responses = {200: {"content": {media_type: {} for media_type in _MEDIA_TYPES.values()}}, **NOT_CHANGED}
_ATLAS: Responses = {200: {"content": {"image/png": {}, "image/webp": {}}}, **NOT_CHANGED}
_PFM = "image/x-portable-floatmap"
_MAP: Responses = {200: {"content": {_PFM: {}}}, **NOT_CHANGED}

FrameNumber = Annotated[int, Path(ge=1, le=MAX_FRAME_NUMBER, description="The number of the frame.")]


def find_frame(job_id: JobId, frame: FrameNumber, state: AppStateDep, _caller: ViewerDep) -> ViewableFrame:
    """Return the frame of a request."""
    state.guard.check(job_id, names.orthoscopic_name(frame))
    # The session is closed before the store is read for the picture: a slow store holds no connection.
    with state.database.reading() as session:
        return frames.find_frame(session, state.parts, job_id, frame)


FrameDep = Annotated[ViewableFrame, Depends(find_frame)]


@dataclass(frozen=True)
class PictureRequest:
    """A request for a picture of a frame."""

    job_id: JobId
    state: AppStateDep
    frame: FrameDep
    caller: ViewerDep
    if_none_match: Annotated[str | None, Header(include_in_schema=False)] = None


PictureRequestDep = Annotated[PictureRequest, Depends()]


@router.get("/look")
def describe_views(
    job_id: JobId,
    frame: FrameDep,
    state: AppStateDep,
    max_px: Annotated[int, Query(ge=16, le=16_384, description="The longest side of the atlas.")] = 4096,
) -> FrameViews:
    """Describe the views of a frame, its depths, and the arrangement of its atlas."""
    state.processes.warm_up()  # A viewer who asks for this asks for pictures next.
    return frames.describe(frame, job_id, max_px=max_px)


@router.get("/view", response_class=Response, responses=_PICTURE)
async def get_view(query: Annotated[ViewQuery, Query()], request: PictureRequestDep) -> Response:
    """Get one view, with one pixel per lens."""
    return await _picture(request, "view", query, render.render_view)


@router.get("/perspective", response_class=Response, responses=_PICTURE)
async def get_perspective(query: Annotated[PerspectiveQuery, Query()], request: PictureRequestDep) -> Response:
    """Get the perspective of an eye, with one pixel per lens. Lenses that send no light to the eye are black."""
    return await _picture(request, "perspective", query, render.render_perspective)


@router.get("/refocus", response_class=Response, responses=_PICTURE)
async def get_refocused(query: Annotated[RefocusQuery, Query()], request: PictureRequestDep) -> Response:
    """Get the picture that is sharp at a depth."""
    return await _picture(request, "refocus", query, render.render_refocus)


@router.get("/observer", response_class=Response, responses=_PICTURE)
async def get_observed(query: Annotated[ObserverQuery, Query()], request: PictureRequestDep) -> Response:
    """Get what one eye or two see of the display, traced through pupil and lenses, with crosstalk and blur."""
    return await _picture(request, "observer", query, render.render_observer)


@router.get("/views.atlas", response_class=Response, responses=_ATLAS)
async def get_atlas(query: Annotated[AtlasQuery, Query()], request: PictureRequestDep) -> Response:
    """Get all views as one picture for a graphics card; `look` describes their arrangement."""
    return await _picture(request, "views.atlas", query, render.render_atlas)


def find_true_depth(job_id: JobId, frame: FrameDep, state: AppStateDep) -> depth.TrueDepth | None:
    """Return the true depth of the frame of a request; None if it was captured without depth."""
    if frame.depth_name is None or frame.stage is None:
        return None
    state.guard.check(job_id, names.depth_name(frame.frame))
    return depth.TrueDepth(frame, frame.stage, frame.depth_name, state.parts.store.etag(frame.depth_name))


TrueDepthDep = Annotated[depth.TrueDepth | None, Depends(find_true_depth)]


@router.get("/depth", responses={200: {"model": FocusDepth}, **NOT_CHANGED})
async def get_focus_depth(
    query: Annotated[FocusQuery, Query()], true_depth: TrueDepthDep, request: PictureRequestDep
) -> Response:
    """Get the depth to which to refocus, so that what is at a place is sharp."""

    def make() -> bytes:
        return depth.focus_depth(lambda wanted: _make(request, wanted), request.frame, true_depth, query)

    return await _made(request, frames.etag_of(request.frame, "depth", query, true_depth), make, "application/json")


@router.get("/depth.map", response_class=Response, responses=_MAP)
async def get_depth_map(
    query: Annotated[DepthMapQuery, Query()], true_depth: TrueDepthDep, request: PictureRequestDep
) -> Response:
    """Get the depths at which the surfaces of a view are sharp: mm as PFM, NaN where they are unknown."""

    def make() -> bytes:
        return _make(request, depth.depth_map(request.frame, true_depth, query))

    return await _made(request, frames.etag_of(request.frame, "depth.map", query, true_depth), make, _PFM)


async def _picture(request: PictureRequest, what: str, query: Any, renderer: render.Renderer) -> Response:
    def make() -> bytes:
        return _make(request, render.FramePicture(request.frame, query, renderer))

    return await _made(request, frames.etag_of(request.frame, what, query), make, _MEDIA_TYPES[query.format])


def _make(request: PictureRequest, wanted: render.Wanted) -> bytes:
    with request.state.guard.reading(request.job_id, wanted.sheet_name.removeprefix(f"{request.job_id}/")):
        return request.state.processes.make(wanted)


async def _made(request: PictureRequest, etag: str, make: Callable[[], bytes], media_type: str) -> Response:
    state = request.state
    headers = {"ETag": etag, "Cache-Control": "private, no-cache", "X-Content-Type-Options": "nosniff"}
    if is_fresh(request.if_none_match, etag):
        return Response(status_code=304, headers=headers)
    budget = Limits(state.settings, request.caller.limits)["picture_s_per_minute"]
    data = await state.pictures.run(request.caller.key_id, make, budget=budget)
    return Response(data, headers=headers, media_type=media_type)
