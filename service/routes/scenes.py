"""Scenes that jobs can ask for."""

from __future__ import annotations

from typing import Annotated, Any, BinaryIO

import anyio
from fastapi import APIRouter, Query, Request, Response
from starlette.datastructures import UploadFile

from lippmann.errors import FieldProblem
from service import scenes
from service.dependencies import CursorQuery, House, HouseDep, LimitQuery, SessionDep, SubmitterDep, ViewerDep
from service.errors import Invalid
from service.schemas.scene import Scene, SceneList

router = APIRouter(prefix="/scenes", tags=["scenes"])

UPLOADS = anyio.CapacityLimiter(2)
"""Bundles looked through at once: each is held in memory for that."""
_BUNDLE = {
    "type": "object",
    "required": ["bundle"],
    "properties": {
        "bundle": {
            "type": "string",
            "contentMediaType": "application/octet-stream",
            "description": "A zip with scene.toml and the scene it names.",
        }
    },
}
_UPLOAD: dict[str, Any] = {
    "requestBody": {"required": True, "content": {"multipart/form-data": {"schema": _BUNDLE}}},
}


@router.get("")
def list_scenes(
    session: SessionDep, _caller: ViewerDep, limit: LimitQuery = 100, cursor: CursorQuery = None
) -> SceneList:
    """List scenes by name."""
    found = scenes.list_scenes(session, after=cursor or "", limit=limit + 1)
    shown = tuple(found[:limit])
    return SceneList(items=shown, next_cursor=shown[-1].name if len(found) > limit else None)


@router.get("/{name}")
def show_scene(name: str, session: SessionDep, _caller: ViewerDep) -> Scene:
    """Show a scene: its parameters, stage and clock."""
    return scenes.show_scene(session, name)


@router.get("/{name}/poster.png", response_class=Response, responses={200: {"content": {"image/png": {}}}})
def show_poster(name: str, session: SessionDep, _caller: ViewerDep) -> Response:
    """Show a scene's picture."""
    data, digest = scenes.poster_of(session, name)
    headers = {"ETag": f'"{digest[:32]}"', "Cache-Control": "private, no-cache", "X-Content-Type-Options": "nosniff"}
    return Response(data, media_type="image/png", headers=headers)


@router.post(
    "",
    status_code=201,
    responses={200: {"description": "This very bundle was there already."}},
    openapi_extra=_UPLOAD,
)
async def upload_scene(
    request: Request,
    house: HouseDep,
    _caller: SubmitterDep,
    name: Annotated[str, Query(max_length=100)],
    response: Response,
) -> Scene:
    """Store a scene bundle under a name."""
    # Read here, not declared as a parameter: FastAPI would read it before it asks who is calling.
    async with request.form(max_files=1, max_fields=10) as form:
        bundle = form.get("bundle")
        if not isinstance(bundle, UploadFile):
            problem = FieldProblem(field="bundle", expected="a file in multipart/form-data", got=repr(bundle)[:120])
            raise Invalid(str(problem), problems=[problem])
        scene, is_new = await anyio.to_thread.run_sync(_store, house, name, bundle.file, limiter=UPLOADS)
    response.status_code = 201 if is_new else 200
    response.headers["Location"] = f"/api/v1/scenes/{scene.name}"
    return scene


def _store(house: House, name: str, file: BinaryIO) -> tuple[Scene, bool]:
    return scenes.upload_scene(house.database, house.parts, name, file.read(), now_s=house.now_s())
