"""Files of a job, whole and in part."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Literal

import anyio
from fastapi import APIRouter, Depends, Header, Path, Query, Request
from fastapi.responses import Response, StreamingResponse

from lippmann.errors import ArtifactMissing, FieldProblem
from lippmann.plan.artifact_store import HasDownloadUrls
from service.api import artifact_files as artifacts
from service.api.artifact_files import File
from service.auth import Caller
from service.dependencies import AppState, AppStateDep, CursorQuery, JobId, LimitQuery, ViewerDep
from service.errors import Invalid
from service.jobs.state_machine import find_job
from service.limits import Limits
from service.routes.description import NOT_CHANGED, Responses, problems
from service.schemas.artifact import ArtifactPage
from service.viewing.render import Conversion

router = APIRouter(prefix="/jobs/{job_id}/artifacts", tags=["artifacts"])

_ANY_FILE: dict[str, Any] = {"content": {"*/*": {}}}
FILE_RESPONSES: Responses = {
    200: _ANY_FILE,
    206: {"description": "The requested range."} | _ANY_FILE,
    **NOT_CHANGED,
    **problems(416),
}
_ARTIFACT_RESPONSES: Responses = FILE_RESPONSES | {
    307: {"description": "The file is at the server of the store, for some minutes; see `Prefer`."}
}
DIRECT = "redirect"
"""The preference of a client that downloads from the server of the store by itself."""
DIRECT_S = 300
"""The time for which such a client may begin a download, s."""


@dataclass(frozen=True)
class Conditions:
    """The headers of a request for a file that decide how much of it is sent."""

    if_none_match: str | None
    if_range: str | None
    byte_range: str | None


def get_conditions(
    if_none_match: Annotated[str | None, Header(include_in_schema=False)] = None,
    if_range: Annotated[str | None, Header(include_in_schema=False)] = None,
    byte_range: Annotated[str | None, Header(alias="Range", include_in_schema=False)] = None,
) -> Conditions:
    """Return the headers that decide how much of a file is sent."""
    return Conditions(if_none_match, if_range, byte_range)


ConditionsDep = Annotated[Conditions, Depends(get_conditions)]


@router.get("")
def list_artifacts(
    job_id: JobId,
    state: AppStateDep,
    _caller: ViewerDep,
    prefix: Annotated[
        str, Query(max_length=200, description="List only files below this folder, such as `integral/`.")
    ] = "",
    limit: LimitQuery = 100,
    cursor: CursorQuery = None,
) -> ArtifactPage:
    """List the files of a job, sorted by name."""
    _check(state, job_id)
    return artifacts.page_artifacts(state.parts.store, job_id, prefix=prefix, cursor=cursor, limit=limit)


@router.get("/{name:path}", response_class=StreamingResponse, responses=_ARTIFACT_RESPONSES)
@router.head("/{name:path}", response_class=Response, include_in_schema=False)
async def get_artifact(
    job_id: JobId,
    name: Annotated[str, Path(description="The name of the file within the job, such as `integral/0001.exr`.")],
    request: Request,
    state: AppStateDep,
    caller: ViewerDep,
    conditions: ConditionsDep,
    as_format: Annotated[Literal["png"] | None, Query(alias="format", description="Convert an EXR to PNG.")] = None,
    bits: Annotated[Literal["8", "16"], Query(description="The bit depth of the PNG.")] = "8",
    prefer: Annotated[
        str | None,
        Header(description="`redirect`: answer with 307 and a URL of the store's own server, where it has one."),
    ] = None,
) -> Response:
    """Get a file, with a strong ETag, If-None-Match, Range and If-Range.

    `Repr-Digest` is the SHA-256 of the whole file. Whoever follows a redirect compares it, because the service does not
    read the file then; in the case of a difference, a request without `Prefer` has the file made again.

    A damaged file is not served: the answer is 503 with Retry-After while the farm makes the file again. A large file
    is verified while it is sent, and a transfer of a damaged one ends before its last bytes.

    `format=png` converts an EXR. The size of the PNG is not known in advance, so HEAD sends no Content-Length for it.
    """
    if as_format == "png":
        file = await anyio.to_thread.run_sync(find_artifact, state, job_id, name, request.method)
        return await _converted(state, caller, job_id, file, int(bits), request.method, conditions.if_none_match)
    is_direct = request.method == "GET" and artifacts.prefers(prefer, DIRECT)
    send = partial(send_artifact, state, job_id, name, conditions, request.method, is_direct=is_direct)
    return await anyio.to_thread.run_sync(send)


def find_artifact(state: AppState, job_id: str, name: str, method: str, *, is_direct: bool = False) -> File:
    """Find a file of a job, and verify it unless the request is HEAD.

    Parameters
    ----------
    is_direct
        True for a client that verifies the content itself.

    Raises
    ------
    NotFound, ArtifactMissing
        If there is no such job or file.
    ArtifactRepairing
        If the file is damaged.
    """
    _check(state, job_id)
    stored = artifacts.full_name(job_id, name)
    # The answer to HEAD has no body that could say what is damaged; the GET that follows says it.
    if method == "HEAD":
        with suppress(ArtifactMissing):
            return artifacts.file_of(state.parts.store.info(stored), name, state.guard.digest(job_id, name))
    found = state.guard.check(job_id, name, content=not is_direct)
    if found is None:
        raise ArtifactMissing(f"expected the artifact {stored}, got nothing there")
    return artifacts.file_of(found.info, name, found.digest)


def send_artifact(
    state: AppState, job_id: str, name: str, conditions: Conditions, method: str, *, is_direct: bool = False
) -> Response:
    """Return the answer with a file, with a part of it, or with 304; in a thread, because the store is read.

    Parameters
    ----------
    is_direct
        True to answer with a URL of the server of the store, if it has one and the digest of the file is known.
    """
    store = state.parts.store
    is_direct = is_direct and isinstance(store, HasDownloadUrls)
    file = find_artifact(state, job_id, name, method, is_direct=is_direct)
    headers = _headers(job_id, file.name, file.etag) | _digest_header(file)
    if artifacts.is_fresh(conditions.if_none_match, file.etag):
        return Response(status_code=304, headers=headers)
    wanted = conditions.byte_range if conditions.if_range in (None, file.etag) else None
    part = artifacts.parse_range(wanted, file.size)
    if is_direct and isinstance(store, HasDownloadUrls) and file.digest is not None:
        return _redirect(store, job_id, file)
    return _stream(state, job_id, file, part, method, headers)


def _redirect(store: HasDownloadUrls, job_id: str, file: File) -> Response:
    disposition, kind = artifacts.disposition(job_id, file.name), artifacts.media_type(file.name)
    url = store.download_url(file.full_name, valid_s=DIRECT_S, disposition=disposition, media_type=kind)
    headers = {"Location": url, "Cache-Control": "no-store", "Preference-Applied": DIRECT, "Vary": "Prefer"}
    return Response(status_code=307, headers=headers)


def _check(state: AppState, job_id: str) -> None:
    # The session is closed before the store is read: a slow store holds no connection.
    with state.database.reading() as session:
        find_job(session, job_id)


def _stream(
    state: AppState, job_id: str, file: File, part: tuple[int, int] | None, method: str, headers: dict[str, str]
) -> Response:
    start, stop = part or (0, file.size)
    headers = headers | {"Content-Length": str(stop - start), "Accept-Ranges": "bytes"}
    if part is not None:
        headers["Content-Range"] = f"bytes {start}-{stop - 1}/{file.size}"
    status, kind = (200 if part is None else 206), artifacts.media_type(file.name)
    if method == "HEAD":
        return Response(status_code=status, headers=headers, media_type=kind)
    chunks = state.parts.store.read_range(file.full_name, start, stop)
    if stop - start == file.size:
        chunks = state.guard.verified_chunks(job_id, file.name, file.digest, chunks, etag=file.etag.strip('"'))
    else:
        state.guard.check_later(job_id, file.name, etag=file.etag.strip('"'))
    return StreamingResponse(chunks, status_code=status, headers=headers, media_type=kind)


async def _converted(
    state: AppState, caller: Caller, job_id: str, file: File, bits: int, method: str, if_none_match: str | None
) -> Response:
    if not file.name.endswith(".exr"):
        problem = FieldProblem(field="format", expected="no format, except for EXR files", got=f"png of {file.name}")
        raise Invalid(str(problem), problems=[problem])
    etag = f'{file.etag[:-1]}-png{bits}"'
    headers = _headers(job_id, file.name.removesuffix(".exr") + ".png", etag)
    if artifacts.is_fresh(if_none_match, etag):
        return Response(status_code=304, headers=headers)
    if method == "HEAD":
        # A plain Response would send a Content-Length of 0.
        return StreamingResponse(iter(()), headers=headers, media_type="image/png")
    budget = Limits(state.settings, caller.limits)["picture_s_per_minute"]
    convert = partial(_convert, state, job_id, file, bits)
    data = await state.pictures.run(caller.key_id, convert, budget=budget)
    return Response(data, headers=headers, media_type="image/png")


def _convert(state: AppState, job_id: str, file: File, bits: int) -> bytes:
    with state.guard.reading(job_id, file.name):
        return state.processes.make(Conversion(file.full_name, bits))


def _digest_header(file: File) -> dict[str, str]:
    return {} if file.digest is None else {"Repr-Digest": artifacts.digest_field(file.digest)}


def _headers(job_id: str, name: str, etag: str) -> dict[str, str]:
    return {
        "ETag": etag,
        "Cache-Control": "private, no-cache",
        "Content-Disposition": artifacts.disposition(job_id, name),
        "X-Content-Type-Options": "nosniff",
    }
