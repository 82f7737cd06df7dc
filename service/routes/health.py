"""How the farm is."""

from __future__ import annotations

from fastapi import APIRouter

from service.dependencies import HouseDep
from service.schemas.farm import Health

router = APIRouter(tags=["farm"])


@router.get("/health")
async def show_health(house: HouseDep) -> Health:
    """Say how the farm is; needs no key and answers within a second."""
    return await house.checks.health(now_s=house.now_s())
