"""Worker keys, with which workers on other machines join the farm."""

from __future__ import annotations

from fastapi import APIRouter

from service.audit import record
from service.db import access as access_rows
from service.dependencies import AdminDep, AppStateDep
from service.schemas.access import AuditAction
from service.schemas.answer import utc, utc_or_none
from service.schemas.worker_keys import NewWorkerKey, WorkerKey, WorkerKeyList, WorkerKeyRequest
from service.worker_keys.joining import create_worker_key as create
from service.worker_keys.joining import make_user

router = APIRouter(tags=["access"])


@router.get("/worker-keys")
def list_worker_keys(state: AppStateDep, _caller: AdminDep) -> WorkerKeyList:
    """List the worker keys, without their secrets."""
    state.last_use.write()
    with state.database.reading() as session:
        rows = [row for row in access_rows.worker_keys(session) if row.revoked_s is None]
    return WorkerKeyList(
        items=tuple(
            WorkerKey(
                id=row.id,
                name=row.name,
                created_at=utc(row.created_s),
                expires_at=utc_or_none(row.expires_s),
                used_at=utc_or_none(row.used_s),
                has_broker_user=row.has_broker_user,
            )
            for row in rows
        )
    )


@router.post("/worker-keys", status_code=201)
def create_worker_key(request: WorkerKeyRequest, state: AppStateDep, caller: AdminDep) -> NewWorkerKey:
    """Create a worker key, and return the join file with which a worker joins the farm. It is shown only once."""
    now_s = state.now_s()
    expires_s = None if request.expires_in_days is None else now_s + request.expires_in_days * 86_400
    with state.database.writing() as session:
        join = create(session, request, settings=state.settings, expires_s=expires_s, now_s=now_s)
        detail = f"name {request.name}"
        record(session, caller, AuditAction.CREATE_WORKER_KEY, join.worker.id, now_s=now_s, detail=detail)
    has_broker_user = False
    if request.broker_user == "own":
        join, has_broker_user = make_user(state.database, state.broker_users, join, caller=caller, now_s=now_s)
    return NewWorkerKey(
        id=join.worker.id, name=request.name, expires_at=utc_or_none(expires_s), has_broker_user=has_broker_user,
        join=join,
    )  # fmt: skip
