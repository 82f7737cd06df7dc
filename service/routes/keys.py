"""Keys and login links."""

from __future__ import annotations

from fastapi import APIRouter

from service import auth as keys
from service.dependencies import AdminDep, AppStateDep, SessionDep
from service.schemas.access import Key, KeyList, KeyRequest, LoginLink, NewKey, Role
from service.schemas.answer import utc

router = APIRouter(tags=["access"])


@router.get("/keys")
def list_keys(session: SessionDep, _caller: AdminDep) -> KeyList:
    """List all keys, without their secrets."""
    rows = keys.list_keys(session)
    items = (Key(id=row.id, name=row.name, role=Role(row.role), created_at=utc(row.created_s)) for row in rows)
    return KeyList(items=tuple(items))


@router.post("/keys", status_code=201)
def create_key(request: KeyRequest, state: AppStateDep, _caller: AdminDep) -> NewKey:
    """Create a key. Its secret cannot be retrieved later."""
    with state.database.writing() as session:
        key_id, key = keys.create_key(session, request.name, request.role)
    return NewKey(id=key_id, name=request.name, role=request.role, key=key)


@router.delete("/keys/{key_id}", status_code=204)
def revoke_key(key_id: str, state: AppStateDep, _caller: AdminDep) -> None:
    """Revoke a key and end the browser sessions that it opened."""
    with state.database.writing() as session:
        keys.revoke_key(session, key_id)


@router.post("/login-tokens", status_code=201)
def create_login_token(state: AppStateDep, caller: AdminDep) -> LoginLink:
    """Create a link that logs in one browser, once."""
    ttl_s, now_s = state.settings.login_token_s, state.now_s()
    with state.database.writing() as session:
        token = keys.create_login_token(
            session, name=caller.name, role=caller.role, ttl_s=ttl_s, parent=caller.key_id, now_s=now_s
        )
    return LoginLink(url=f"{state.settings.base_url}/login?token={token}", expires_at=utc(now_s + ttl_s))
