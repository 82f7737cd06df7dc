"""The design of a job file."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Body, Header, Query, Response
from fastapi.responses import JSONResponse

from service.api.design import check_job_file, design_job, draw_job
from service.dependencies import AppStateDep, ScopeDep, ViewerDep
from service.routes.jobs import JOB_FILE
from service.schemas.check import JobCheck
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


@router.post("/check")  # No schema of the body: there is no JSON that it refuses.
def check_job(state: AppStateDep, caller: ViewerDep, body: Annotated[Any, Body()]) -> JobCheck:
    """Check a job file as a submission does, and store nothing: what is wrong at which field, design and limits.

    An invalid job file is answered with 200 and the fields at fault, so that a form asks while somebody writes.
    """
    return check_job_file(state.database, caller, body, settings=state.settings)
