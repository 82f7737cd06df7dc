"""The work of the farm: what it does now, what it did in the last hours, and who uses it."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from starlette.concurrency import run_in_threadpool

from service.api.farm_history import farm_history
from service.api.farm_work import farm_work, owner_work
from service.dependencies import AppStateDep, ScopeDep, ViewerDep
from service.schemas.work import FarmHistory, FarmWork, OwnerWorkList

router = APIRouter(prefix="/farm", tags=["farm"])


@router.get("")
async def get_work(state: AppStateDep, scope: ScopeDep) -> FarmWork:
    """Get what workers run, which of it seems to be stuck, which jobs wait and why, and the room of the store."""
    reading = await state.farm_reader.read(now_s=state.now_s())

    def read() -> FarmWork:
        outlook = state.outlook()
        with state.database.reading() as session:
            return farm_work(session, outlook, owner_id=scope)

    work = await run_in_threadpool(read)
    return work.model_copy(
        update={
            "free_bytes": reading.store and reading.store.free_bytes,
            "free_files": reading.store and reading.store.free_files,
            "artifact_bytes": reading.database and reading.database.artifact_bytes,
        }
    )


@router.get("/history")
def get_history(
    state: AppStateDep,
    _caller: ViewerDep,
    hours: Annotated[int, Query(ge=1, le=168, description="The number of hours.")] = 24,
) -> FarmHistory:
    """Get how many frames were finished and how many slots were in use in the last hours."""
    with state.database.reading() as session:
        return farm_history(session, hours=hours, now_s=state.now_s())


@router.get("/owners")
def list_owners(state: AppStateDep, scope: ScopeDep) -> OwnerWorkList:
    """List what the stored jobs of each owner took: CPU time, frames, bytes."""
    with state.database.reading() as session:
        return owner_work(session, owner_id=scope)
