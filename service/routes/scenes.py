"""The scenes that jobs can use."""

from __future__ import annotations

from typing import Annotated, Any, BinaryIO

import anyio
from fastapi import APIRouter, Query, Request, Response
from starlette.datastructures import UploadFile

from lippmann.errors import FieldProblem
from service import scenes
from service.auth import Caller
from service.dependencies import AppState, AppStateDep, CursorQuery, LimitQuery, ScopeDep, SubmitterDep
from service.errors import Invalid
from service.routes.description import Responses, problems
from service.schemas.scene import Scene, SceneList

router = APIRouter(prefix="/scenes", tags=["scenes"])

UPLOADS = anyio.CapacityLimiter(2)
"""The number of bundles that are checked concurrently. Each is held in memory during the check."""
_BUNDLE = {
    "type": "object",
    "required": ["bundle"],
    "properties": {
        "bundle": {
            "type": "string",
            "contentMediaType": "application/octet-stream",
            "description": "A zip file with scene.toml and the files of the scene.",
        }
    },
}
_SAME: Responses = {200: {"model": Scene, "description": "The same bundle is already stored under this name."}}
_UPLOAD: dict[str, Any] = {
    "requestBody": {"required": True, "content": {"multipart/form-data": {"schema": _BUNDLE}}},
}


@router.get("")
def list_scenes(state: AppStateDep, scope: ScopeDep, limit: LimitQuery = 100, cursor: CursorQuery = None) -> SceneList:
    """List scenes, sorted by name."""
    with state.database.reading() as session:
        found = scenes.list_scenes(session, after=cursor or "", limit=limit + 1, owner_id=scope)
    page = tuple(found[:limit])
    return SceneList(items=page, next_cursor=page[-1].name if len(found) > limit else None)


@router.get("/{name}")
def get_scene(name: str, state: AppStateDep, scope: ScopeDep) -> Scene:
    """Get a scene with its parameters, stage and clock."""
    with state.database.reading() as session:
        return scenes.get_scene(session, name, owner_id=scope)


@router.get("/{name}/poster.png", response_class=Response, responses={200: {"content": {"image/png": {}}}})
def get_poster(name: str, state: AppStateDep, scope: ScopeDep) -> Response:
    """Get the poster of a scene."""
    with state.database.reading() as session:
        data, digest = scenes.poster_of(session, name, owner_id=scope)
    headers = {"ETag": f'"{digest[:32]}"', "Cache-Control": "private, no-cache", "X-Content-Type-Options": "nosniff"}
    return Response(data, media_type="image/png", headers=headers)


@router.post(
    "",
    status_code=201,
    responses=_SAME | problems(400, 409),
    openapi_extra=_UPLOAD,
)
async def upload_scene(
    request: Request,
    state: AppStateDep,
    caller: SubmitterDep,
    name: Annotated[
        str, Query(max_length=100, description="The name of the scene: lower-case letters, digits, dashes.")
    ],
    response: Response,
) -> Scene:
    """Upload a scene bundle under a name. Only the owner of a scene and admins replace it."""
    # The body is read here, because FastAPI would read a declared parameter before it authenticates the caller.
    async with request.form(max_files=1, max_fields=10) as form:
        bundle = form.get("bundle")
        if not isinstance(bundle, UploadFile):
            problem = FieldProblem(
                field="bundle", expected="a file in multipart/form-data", got="nothing" if bundle is None else "text"
            )
            raise Invalid(str(problem), problems=[problem])
        scene, is_new = await anyio.to_thread.run_sync(_store, state, caller, name, bundle.file, limiter=UPLOADS)
    response.status_code = 201 if is_new else 200
    response.headers["Location"] = f"{state.settings.path_prefix}/api/v1/scenes/{scene.name}"
    return scene


@router.delete("/{name}", status_code=204, responses=problems(403, 409))
def remove_scene(name: str, state: AppStateDep, caller: SubmitterDep) -> None:
    """Remove an uploaded scene. Only its owner and admins do; jobs that were submitted with it keep it."""
    scenes.remove_scene(state.database, caller, name, now_s=state.now_s(), settings=state.settings)


def _store(state: AppState, caller: Caller, name: str, file: BinaryIO) -> tuple[Scene, bool]:
    return scenes.upload_scene(
        state.database, state.parts, caller, name, file.read(), now_s=state.now_s(), settings=state.settings
    )
