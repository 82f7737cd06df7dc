"""Who is there."""

from __future__ import annotations

from fastapi import APIRouter

from service.dependencies import HouseDep, ViewerDep
from service.schemas.farm import WorkerList

router = APIRouter(tags=["farm"])


@router.get("/workers")
async def list_workers(house: HouseDep, _caller: ViewerDep) -> WorkerList:
    """List the workers that are there."""
    return await house.checks.workers()
