"""The health of the farm, and the description of the API."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Cookie, Header, Request
from fastapi.responses import JSONResponse

from service.dependencies import AppStateDep, ViewerDep, find_caller
from service.schemas.access import Role
from service.schemas.farm import Health

router = APIRouter(tags=["farm"])


@router.get("/health")
async def get_health(
    request: Request,
    state: AppStateDep,
    authorization: Annotated[str | None, Header(include_in_schema=False)] = None,
    lippmann_session: Annotated[str | None, Cookie(include_in_schema=False)] = None,
) -> Health:
    """Get the health of the farm within a second. Without a key the answer only names the healthy components."""

    def role() -> Role | None:
        # This runs with the other checks and not as a dependency, so that a database that hangs delays no answer.
        caller = find_caller(request, state, authorization, lippmann_session, x_lippmann_request=None)
        return None if caller is None else caller.role

    return await state.checks.health(now_s=state.now_s(), role=role)


@router.get("/openapi.json", include_in_schema=False)
def get_contract(request: Request, _caller: ViewerDep) -> JSONResponse:
    """Get the OpenAPI description of the API."""
    return JSONResponse(request.app.openapi())
