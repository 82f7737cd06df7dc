"""Scenes that jobs can ask for."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, File, Query, Response, UploadFile

from service.dependencies import CursorQuery, HouseDep, LimitQuery, SessionDep, SubmitterDep, ViewerDep
from service.jobs import scenes
from service.schemas.scene import Scene, SceneList

router = APIRouter(prefix="/scenes", tags=["scenes"])


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


@router.post("", status_code=201, responses={200: {"description": "This very bundle was there already."}})
def upload_scene(
    house: HouseDep,
    _caller: SubmitterDep,
    name: Annotated[str, Query(max_length=100)],
    bundle: Annotated[UploadFile, File(description="A zip with scene.toml and scene.inc.")],
    response: Response,
) -> Scene:
    """Store a scene bundle under a name."""
    scene, is_new = scenes.upload_scene(house.database, house.parts, name, bundle.file.read(), now_s=house.now_s())
    response.status_code = 201 if is_new else 200
    response.headers["Location"] = f"/api/v1/scenes/{scene.name}"
    return scene
