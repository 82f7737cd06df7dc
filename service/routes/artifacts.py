"""Files of a job, whole and in part."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import anyio
from fastapi import APIRouter, Header, Query, Request
from fastapi.responses import Response, StreamingResponse

from lippmann.errors import FieldProblem
from service.api import artifact_files as artifacts
from service.api.artifact_files import File
from service.dependencies import CursorQuery, House, HouseDep, LimitQuery, ViewerDep
from service.errors import Invalid
from service.jobs.state_machine import find_job
from service.schemas.artifact import ArtifactPage

router = APIRouter(prefix="/jobs/{job_id}/artifacts", tags=["artifacts"])

CONVERSIONS = anyio.CapacityLimiter(2)
"""Pictures converted at once: each takes a core and a few times its size in memory."""
_Responses = dict[int | str, dict[str, Any]]
_FILE: _Responses = {200: {"content": {"application/octet-stream": {}}}, 206: {"description": "The range asked for."}}


@router.get("")
def list_artifacts(
    job_id: str,
    house: HouseDep,
    _caller: ViewerDep,
    prefix: Annotated[str, Query(max_length=200, description="Such as `integral/`.")] = "",
    limit: LimitQuery = 100,
    cursor: CursorQuery = None,
) -> ArtifactPage:
    """List files of a job by name."""
    _check(house, job_id)
    return artifacts.page_artifacts(house.parts.store, job_id, prefix=prefix, cursor=cursor, limit=limit)


@router.get("/{name:path}", response_class=StreamingResponse, responses=_FILE)
@router.head("/{name:path}", response_class=Response, include_in_schema=False)
async def fetch_artifact(
    job_id: str,
    name: str,
    request: Request,
    house: HouseDep,
    _caller: ViewerDep,
    as_format: Annotated[Literal["png"] | None, Query(alias="format", description="Convert an EXR.")] = None,
    bits: Annotated[Literal["8", "16"], Query(description="Of a PNG.")] = "8",
    if_none_match: Annotated[str | None, Header(include_in_schema=False)] = None,
    if_range: Annotated[str | None, Header(include_in_schema=False)] = None,
    byte_range: Annotated[str | None, Header(alias="Range", include_in_schema=False)] = None,
) -> Response:
    """Fetch a file: strong ETag, If-None-Match, Range, If-Range.

    `format=png` converts an EXR; nobody knows how long the PNG is before it is made, so HEAD says no Content-Length.
    """
    file = await anyio.to_thread.run_sync(_find, house, job_id, name)
    if as_format == "png":
        return await _picture(house, job_id, file, int(bits), request.method, if_none_match)
    if artifacts.is_fresh(if_none_match, file.etag):
        return Response(status_code=304, headers=_headers(job_id, file.name, file.etag))
    wanted = byte_range if if_range in (None, file.etag) else None
    return _stream(house, job_id, file, artifacts.parse_range(wanted, file.size), request.method)


def _check(house: House, job_id: str) -> None:
    # Given back at once: a slow store holds no connection.
    with house.database.reading() as session:
        find_job(session, job_id)


def _find(house: House, job_id: str, name: str) -> File:
    _check(house, job_id)
    return artifacts.find_file(house.parts.store, job_id, name)


def _stream(house: House, job_id: str, file: File, part: tuple[int, int] | None, method: str) -> Response:
    start, stop = part or (0, file.size)
    headers = _headers(job_id, file.name, file.etag) | {"Content-Length": str(stop - start), "Accept-Ranges": "bytes"}
    if part is not None:
        headers["Content-Range"] = f"bytes {start}-{stop - 1}/{file.size}"
    status, kind = (200 if part is None else 206), artifacts.media_type(file.name)
    if method == "HEAD":
        return Response(status_code=status, headers=headers, media_type=kind)
    chunks = house.parts.store.read_range(file.full_name, start, stop)
    return StreamingResponse(chunks, status_code=status, headers=headers, media_type=kind)


async def _picture(
    house: House, job_id: str, file: File, bits: int, method: str, if_none_match: str | None
) -> Response:
    if not file.name.endswith(".exr"):
        problem = FieldProblem(field="format", expected="nothing but for EXR files", got=f"png of {file.name}")
        raise Invalid(str(problem), problems=[problem])
    etag = f'{file.etag[:-1]}-png{bits}"'
    headers = _headers(job_id, file.name.removesuffix(".exr") + ".png", etag)
    if artifacts.is_fresh(if_none_match, etag):
        return Response(status_code=304, headers=headers)
    if method == "HEAD":
        # A plain Response would say that the picture has 0 bytes.
        return StreamingResponse(iter(()), headers=headers, media_type="image/png")
    data = await anyio.to_thread.run_sync(_convert, house, file, bits, limiter=CONVERSIONS)
    return Response(data, headers=headers, media_type="image/png")


def _convert(house: House, file: File, bits: int) -> bytes:
    with house.parts.store.local_path(file.full_name) as path:
        return house.parts.pictures.png(path, bits=bits)


def _headers(job_id: str, name: str, etag: str) -> dict[str, str]:
    return {
        "ETag": etag,
        "Cache-Control": "private, no-cache",
        "Content-Disposition": artifacts.disposition(job_id, name),
        "X-Content-Type-Options": "nosniff",
    }
