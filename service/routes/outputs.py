"""Outputs of a job with all their files in one zip."""

from __future__ import annotations

from typing import Annotated, Any

import anyio
from fastapi import APIRouter, Path
from fastapi.responses import StreamingResponse

from service.api.artifact_files import disposition
from service.api.output_archive import find_archive
from service.dependencies import AppStateDep, JobId, ViewerDep

router = APIRouter(prefix="/jobs/{job_id}/outputs", tags=["artifacts"])

_ZIP: dict[int | str, dict[str, Any]] = {200: {"content": {"application/zip": {}}}}


@router.get("/{name}.zip", response_class=StreamingResponse, responses=_ZIP)
async def get_output_archive(
    job_id: JobId,
    name: Annotated[str, Path(description="The file name of the output, such as `view_grid.png`.")],
    state: AppStateDep,
    _caller: ViewerDep,
) -> StreamingResponse:
    """Get all files of an output in one zip, uncompressed and with its size in `Content-Length`.

    A missing file is found before the answer begins. A damaged one ends the transfer early, so that a zip of the whole
    size is whole.
    """
    store, guard = state.parts.store, state.guard
    archive = await anyio.to_thread.run_sync(find_archive, state.database, store, guard, job_id, name)
    headers = {
        "Content-Length": str(archive.size),
        "Content-Disposition": disposition(job_id, f"{name}.zip"),
        "Cache-Control": "private, no-cache",
        "X-Content-Type-Options": "nosniff",
    }
    return StreamingResponse(archive.chunks, headers=headers, media_type="application/zip")
