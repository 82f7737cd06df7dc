"""The workers that are online: list, drain, exclude and forgive them."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Path

from lippmann.job.messages.events import Presence
from service.audit import record
from service.db import drains as drain_rows
from service.db import faults as fault_rows
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
    """List the workers that are online, and those that are excluded."""
    return await state.checks.workers(now_s=state.now_s())


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


@router.put("/workers/{worker:path}/exclusion", status_code=204, responses=problems(404, 503))
def exclude_worker(worker: WorkerPath, state: AppStateDep, caller: AdminDep) -> None:
    """Exclude a worker: it takes no further orders and finishes its tasks. A restart of the worker changes nothing."""
    found = _online(state, worker)
    if found.instance is None:
        raise NotFound(f"the worker {worker!r} runs a release that cannot be excluded; stop it")
    with state.database.writing() as session:
        drain_rows.exclude(session, worker, name=caller.name, now_s=state.now_s())
        record(session, caller, AuditAction.EXCLUDE_WORKER, worker, now_s=state.now_s())
    state.wakeup.notify()


@router.delete("/workers/{worker:path}/exclusion", status_code=204, responses=problems(404))
def include_worker(worker: WorkerPath, state: AppStateDep, caller: AdminDep) -> None:
    """Let a worker that was excluded take orders again."""
    with state.database.writing() as session:
        if not drain_rows.include(session, worker):
            raise NotFound(f"no worker {worker!r} is excluded")
        record(session, caller, AuditAction.INCLUDE_WORKER, worker, now_s=state.now_s())
    state.wakeup.notify()


@router.delete("/workers/{worker:path}/faults", status_code=204, responses=problems(404))
def forgive_worker(worker: WorkerPath, state: AppStateDep, caller: AdminDep) -> None:
    """Forget the failures of a worker, so that the jobs which avoid it give it tasks again."""
    with state.database.writing() as session:
        jobs = fault_rows.forgive(session, worker)
        if not jobs:
            raise NotFound(f"no job has a failure of the worker {worker!r}")
        record(session, caller, AuditAction.FORGIVE_WORKER, worker, now_s=state.now_s(), detail=f"jobs {jobs}")
    state.wakeup.notify()


def _online(state: AppState, name: str) -> Presence:
    roster = state.roster.latest()
    if roster is None:
        raise BrokerUnavailable("the broker does not answer, so no worker is known")
    found = next((one for one in roster.present if one.name == name), None)
    if found is None:
        raise NotFound(f"there is no worker {name!r} online")
    return found
