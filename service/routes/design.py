"""The design of a job file."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Body, Header, Query, Response
from fastapi.responses import JSONResponse

from service.api.design import design_job, draw_job
from service.dependencies import AppStateDep, ScopeDep
from service.routes.jobs import JOB_FILE
from service.schemas.design import Design

SVG = "image/svg+xml"
DRAWING: dict[str, Any] = {"content": {SVG: {"schema": {"type": "string"}}}}

router = APIRouter(prefix="/design", tags=["design"])


@router.post("", response_model=Design, openapi_extra=JOB_FILE, responses={200: DRAWING})
def compute_design(
    state: AppStateDep,
    scope: ScopeDep,
    body: Annotated[Any, Body()],
    frame: Annotated[
        int | None, Query(ge=1, le=999_999, description="The number of the frame, by default the first of the job.")
    ] = None,
    accept: Annotated[str, Header(include_in_schema=False)] = "",
) -> Response:
    """Compute the design of a job file without storing it: JSON, or a drawing with `Accept: image/svg+xml`."""
    headers = {"Vary": "Accept", "Cache-Control": "no-store", "X-Content-Type-Options": "nosniff"}
    if SVG in accept:
        return Response(draw_job(state.database, body, frame=frame, owner_id=scope), media_type=SVG, headers=headers)
    found = design_job(state.database, body, frame=frame, owner_id=scope)
    return JSONResponse(found.model_dump(mode="json"), headers=headers)
