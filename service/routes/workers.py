"""The workers that are online."""

from __future__ import annotations

from fastapi import APIRouter

from service.dependencies import AppStateDep, ViewerDep
from service.schemas.farm import WorkerList

router = APIRouter(tags=["farm"])


@router.get("/workers")
async def list_workers(state: AppStateDep, _caller: ViewerDep) -> WorkerList:
    """List the workers that are online."""
    return await state.checks.workers()
