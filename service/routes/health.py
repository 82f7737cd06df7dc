"""How the farm is."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Cookie, Header, Request

from service.dependencies import HouseDep, get_caller_or_none
from service.schemas.farm import Health

router = APIRouter(tags=["farm"])


@router.get("/health")
async def show_health(
    request: Request,
    house: HouseDep,
    authorization: Annotated[str | None, Header(include_in_schema=False)] = None,
    lippmann_session: Annotated[str | None, Cookie(include_in_schema=False)] = None,
) -> Health:
    """Say how the farm is; needs no key, says a little more with one, and answers within a second."""

    def is_known() -> bool:
        # Asked with the other questions and not as a dependency: a database that hangs must not delay the answer.
        return get_caller_or_none(request, house, authorization, None, lippmann_session) is not None

    return await house.checks.health(now_s=house.now_s(), is_known=is_known)
