"""Keys, limits and usage, login links, browser sessions and the audit log."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from service import auth as keys
from service import browser_sessions
from service.api import listings
from service.api.usage import usage_of
from service.audit import record
from service.dependencies import AdminDep, AppStateDep, CursorQuery, LimitQuery, ViewerDep
from service.schemas.access import (
    AuditAction,
    AuditPage,
    BrowserSession,
    BrowserSessionList,
    Key,
    KeyList,
    KeyRequest,
    LoginLink,
    NewKey,
    Role,
)
from service.schemas.answer import utc, utc_or_none
from service.schemas.usage import Usage
from service.worker_keys.joining import end_connections, revoke_worker_key

router = APIRouter(tags=["access"])


@router.get("/keys")
def list_keys(state: AppStateDep, _caller: AdminDep) -> KeyList:
    """List all keys, without their secrets."""
    state.last_use.write()
    with state.database.reading() as session:
        rows = keys.list_keys(session)
    return KeyList(
        items=tuple(
            Key(
                id=row.id,
                name=row.name,
                role=Role(row.role),
                owner_id=row.owner_id,
                created_at=utc(row.created_s),
                expires_at=utc_or_none(row.expires_s),
                used_at=utc_or_none(row.used_s),
                limits=keys.limits_of(row),
            )
            for row in rows
        )
    )


@router.post("/keys", status_code=201)
def create_key(request: KeyRequest, state: AppStateDep, caller: AdminDep) -> NewKey:
    """Create a key. Its secret cannot be retrieved later."""
    now_s = state.now_s()
    expires_s = None if request.expires_in_days is None else now_s + request.expires_in_days * 86_400
    with state.database.writing() as session:
        key_id, key = keys.create_key(
            session,
            request.name,
            request.role,
            owner_id=request.owner_id,
            expires_s=expires_s,
            limits=request.limits,
            now_s=now_s,
        )
        detail = f"name {request.name}, role {request.role}, owner {request.owner_id or key_id}"
        record(session, caller, AuditAction.CREATE_KEY, key_id, now_s=now_s, detail=detail)
    return NewKey(
        id=key_id,
        name=request.name,
        role=request.role,
        owner_id=request.owner_id or key_id,
        expires_at=utc_or_none(expires_s),
        limits=request.limits,
        key=key,
    )


@router.delete("/keys/{key_id}", status_code=204)
def revoke_key(key_id: str, state: AppStateDep, caller: AdminDep) -> None:
    """Revoke a key, also that of a worker.

    The browser sessions that it opened and all their event streams end at once. What a worker with a revoked key does
    counts no more.
    """
    with state.database.writing() as session:
        is_of_worker = revoke_worker_key(session, key_id, now_s=state.now_s())
        if not is_of_worker:
            keys.revoke_key(session, key_id)
        record(session, caller, AuditAction.REVOKE_KEY, key_id, now_s=state.now_s())
    state.hub.check_credentials()
    if is_of_worker:
        end_connections(state.database, state.broker_users, now_s=state.now_s())


@router.get("/usage")
def get_usage(state: AppStateDep, caller: ViewerDep) -> Usage:
    """Get what the owner of the key uses of the farm, and the limits of the key."""
    with state.database.reading() as session:
        return usage_of(session, caller, state.settings)


@router.get("/sessions")
def list_sessions(state: AppStateDep, _caller: AdminDep) -> BrowserSessionList:
    """List the open browser sessions."""
    state.last_use.write()
    with state.database.reading() as session:
        rows = browser_sessions.list_sessions(session, now_s=state.now_s(), lifetimes=state.lifetimes)
    return BrowserSessionList(
        items=tuple(
            BrowserSession(
                id=row.id,
                name=row.name,
                role=Role(row.role),
                owner_id=row.owner_id,
                key_id=row.parent,
                created_at=utc(row.created_s),
                expires_at=utc_or_none(row.expires_s),
                used_at=utc_or_none(row.used_s),
            )
            for row in rows
        )
    )


@router.delete("/sessions/{session_id}", status_code=204)
def end_session(session_id: str, state: AppStateDep, caller: AdminDep) -> None:
    """End a browser session and its event streams at once."""
    with state.database.writing() as session:
        browser_sessions.end_session_called(session, session_id)
        record(session, caller, AuditAction.END_SESSION, session_id, now_s=state.now_s())
    state.hub.check_credentials()


@router.post("/login-tokens", status_code=201)
def create_login_token(state: AppStateDep, caller: AdminDep) -> LoginLink:
    """Create a link that logs in one browser, once."""
    ttl_s, now_s = state.settings.login_token_s, state.now_s()
    with state.database.writing() as session:
        token = keys.create_login_token(
            session, name=caller.name, role=caller.role, ttl_s=ttl_s, owner_id=caller.owner_id, parent=caller.key_id,
            now_s=now_s,
        )  # fmt: skip
        record(session, caller, AuditAction.CREATE_LOGIN_LINK, token.partition(".")[0], now_s=now_s)
    return LoginLink(url=f"{state.settings.base_url}/login?token={token}", expires_at=utc(now_s + ttl_s))


@router.get("/audit")
def list_changes(
    state: AppStateDep,
    _caller: AdminDep,
    limit: LimitQuery = 100,
    cursor: CursorQuery = None,
    action: Annotated[AuditAction | None, Query(description="List only changes of this kind.")] = None,
    name: Annotated[
        str | None, Query(max_length=100, description="List only changes by keys with this name or this id.")
    ] = None,
    subject: Annotated[
        str | None, Query(max_length=200, description="List only changes of this job, task, scene, key or worker.")
    ] = None,
) -> AuditPage:
    """List the changes that were made through the API, newest first: who, what, when, from where."""
    with state.database.reading() as session:
        return listings.page_audit(session, cursor=cursor, limit=limit, action=action, name=name, subject=subject)
