"""The preview of a job file."""

from __future__ import annotations

import time
from typing import Annotated, Any

from fastapi import APIRouter, Body, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from lippmann.plan.preview import PreviewPicture, PreviewSize, PreviewTimes, rig_numbers
from service.dependencies import AppStateDep, SubmitterDep
from service.previews.prepare import prepare
from service.routes.description import problems
from service.routes.jobs import JOB_FILE
from service.schemas.preview import Preview, PreviewQuery

router = APIRouter(prefix="/preview", tags=["design"])


@router.post("", openapi_extra=JOB_FILE, responses=problems(409, 503))
async def render_preview(
    state: AppStateDep,
    caller: SubmitterDep,
    body: Annotated[Any, Body()],
    query: Annotated[PreviewQuery, Query()],
    request: Request,
    response: Response,
) -> Preview:
    """Render one frame of a job file at once with fewer lenses and pixels, and store nothing.

    A worker renders it beside its tasks. Of a series, the newest preview alone is answered.
    """
    began_s = time.monotonic()
    await state.previews.check_rate(caller)
    prepared = await run_in_threadpool(
        prepare,
        state.database,
        caller,
        body,
        frame=query.frame,
        size=PreviewSize(query.lenses, query.px_per_lens),
        settings=state.settings,
    )
    worker, made = await state.previews.run(
        caller, prepared, stream=query.stream, roster=state.roster, is_gone=request.is_disconnected
    )
    response.headers["Cache-Control"] = "no-store"
    return Preview(
        scene=prepared.scene,
        frame=prepared.frame,
        engine=prepared.job.engine,
        integral=_picture(made.integral_png, made.integral_size),
        view=_picture(made.view_png, made.view_size),
        rig=rig_numbers(prepared.job.spec.rig),
        notes=(*prepared.notes, *made.notes),
        times=PreviewTimes.model_validate(made, from_attributes=True),
        total_s=time.monotonic() - began_s,
        worker=worker,
    )


def _picture(png: str, size: tuple[int, int]) -> PreviewPicture:
    return PreviewPicture(rows=size[0], cols=size[1], png=png)
