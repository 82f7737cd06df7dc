"""The workers that are online: list them, drain them, and let them take orders again."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Path

from lippmann.job.messages.events import Presence
from service.audit import record
from service.db import drains as drain_rows
from service.db.tables import INSTANCE_CHARS
from service.dependencies import AdminDep, AppState, AppStateDep, ViewerDep
from service.errors import BrokerUnavailable, NotFound
from service.routes.description import problems
from service.schemas.access import AuditAction
from service.schemas.farm import DrainRequest, WorkerList

router = APIRouter(tags=["farm"])

WorkerPath = Annotated[str, Path(description="The name of the worker.", max_length=100)]


@router.get("/workers")
async def list_workers(state: AppStateDep, _caller: ViewerDep) -> WorkerList:
    """List the workers that are online."""
    return await state.checks.workers()


@router.put("/workers/{worker:path}/drain", status_code=204, responses=problems(404, 503))
def drain_worker(
    worker: WorkerPath, state: AppStateDep, caller: AdminDep, request: Annotated[DrainRequest | None, Body()] = None
) -> None:
    """Drain a worker: it takes no further orders and finishes its tasks. A restart of the worker ends the drain."""
    ends, instance = (request or DrainRequest()).ends, _online(state, worker).instance
    if instance is None:
        raise NotFound(f"the worker {worker!r} runs a release that cannot be drained; stop it")
    if len(instance) > INSTANCE_CHARS:
        raise NotFound(f"the worker {worker!r} has an instance of more than {INSTANCE_CHARS} characters; stop it")
    with state.database.writing() as session:
        drain_rows.set_drain(session, worker, instance, ends=ends, now_s=state.now_s())
        detail = "ends afterwards" if ends else ""
        record(session, caller, AuditAction.DRAIN_WORKER, worker, now_s=state.now_s(), detail=detail)
    state.wakeup.notify()


@router.delete("/workers/{worker:path}/drain", status_code=204, responses=problems(404))
def undrain_worker(worker: WorkerPath, state: AppStateDep, caller: AdminDep) -> None:
    """Let a worker that was drained take orders again."""
    with state.database.writing() as session:
        if not drain_rows.delete_drain(session, worker):
            raise NotFound(f"no worker {worker!r} was drained here; one that was drained by a signal is restarted")
        record(session, caller, AuditAction.UNDRAIN_WORKER, worker, now_s=state.now_s())
    state.wakeup.notify()


def _online(state: AppState, name: str) -> Presence:
    roster = state.roster.latest()
    if roster is None:
        raise BrokerUnavailable("the broker does not answer, so no worker is known")
    found = next((one for one in roster.present if one.name == name), None)
    if found is None:
        raise NotFound(f"there is no worker {name!r} online")
    return found
