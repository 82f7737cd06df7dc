"""Links to files of a job that need no key and expire."""

from __future__ import annotations

from typing import Annotated

import anyio
from fastapi import APIRouter, Path, Query, Request
from fastapi.responses import Response, StreamingResponse

from lippmann.errors import FieldProblem
from service import auth
from service.audit import record
from service.dependencies import AppState, AppStateDep, JobId, ViewerDep, check_visible
from service.errors import Invalid, Unauthorized
from service.query_names import check_query
from service.routes.artifacts import FILE_RESPONSES, ConditionsDep, find_artifact, send_artifact
from service.routes.description import problems
from service.schemas.access import AuditAction
from service.schemas.answer import utc
from service.schemas.artifact import ArtifactLink, LinkRequest
from service.schemas.links import signed_url

DAY_S = 86_400.0

router = APIRouter(tags=["artifacts"])


@router.post("/jobs/{job_id}/links", status_code=201)
def create_link(job_id: JobId, wanted: LinkRequest, state: AppStateDep, caller: ViewerDep) -> ArtifactLink:
    """Create a link that downloads one file of a job without a key.

    It ends when it expires, when the job is removed, and when the key that made it is revoked or may no longer see the
    job.
    """
    longest_s = state.settings.link_max_s
    valid_s = min(DAY_S, longest_s) if wanted.expires_in_s is None else wanted.expires_in_s
    if valid_s > longest_s:
        expected = f"at most {longest_s:g} s, the limit of the farm"
        problem = FieldProblem(field="expires_in_s", expected=expected, got=f"{valid_s:g}")
        raise Invalid(str(problem), problems=[problem])
    file = find_artifact(state, job_id, wanted.artifact, "HEAD")
    now_s = state.now_s()
    expires_s = int(now_s + valid_s)
    token = state.links.token(job_id, file.name, expires_s=expires_s, key_id=caller.key_id)
    expires_at = utc(expires_s)
    with state.database.writing() as session:
        detail = f"{file.name} until {expires_at:%Y-%m-%dT%H:%M:%SZ}"
        record(session, caller, AuditAction.LINK_ARTIFACT, job_id, now_s=now_s, detail=detail)
    url = state.settings.base_url + signed_url(job_id, file.name, token=token)
    return ArtifactLink(artifact=file.name, url=url, expires_at=expires_at)


@router.get(
    "/links/{job_id}/{name:path}", response_class=StreamingResponse, responses=FILE_RESPONSES | problems(401, 503)
)
@router.head("/links/{job_id}/{name:path}", response_class=Response, include_in_schema=False)
async def get_linked_artifact(
    job_id: Annotated[str, Path(description="The id of the job.")],
    name: Annotated[str, Path(description="The name of the file within the job, such as `integral/0001.exr`.")],
    request: Request,
    state: AppStateDep,
    conditions: ConditionsDep,
    token: Annotated[str, Query(description="The token of the link. No key is needed.")] = "",
) -> Response:
    """Get the file of a link, with a strong ETag, If-None-Match, Range and If-Range."""
    await anyio.to_thread.run_sync(_check, state, token, job_id, name)
    await check_query(request)
    return await anyio.to_thread.run_sync(send_artifact, state, job_id, name, conditions, request.method)


def _check(state: AppState, token: str, job_id: str, name: str) -> None:
    key_id = state.links.maker(token, job_id, name, now_s=state.now_s())
    with state.database.reading() as session:
        maker = auth.caller_of_id(session, key_id, now_s=state.now_s(), idle_s=state.settings.session_idle_s)
    if maker is None:
        raise Unauthorized("the key that made this link was revoked or has expired; ask for a new link")
    check_visible(state, job_id, maker.scope(sharing=state.settings.sharing))
