"""Keys and login links."""

from __future__ import annotations

from fastapi import APIRouter

from service import auth as keys
from service.dependencies import AdminDep, HouseDep, SessionDep
from service.schemas.access import Key, KeyList, KeyWish, LoginLink, NewKey, Role
from service.schemas.answer import utc

router = APIRouter(tags=["access"])


@router.get("/keys")
def list_keys(session: SessionDep, _caller: AdminDep) -> KeyList:
    """List keys, without their secrets."""
    rows = keys.list_keys(session)
    items = (Key(id=row.id, name=row.name, role=Role(row.role), created_at=utc(row.created_s)) for row in rows)
    return KeyList(items=tuple(items))


@router.post("/keys", status_code=201)
def create_key(wish: KeyWish, house: HouseDep, _caller: AdminDep) -> NewKey:
    """Make a key; it is shown this once."""
    with house.database.writing() as session:
        key_id, key = keys.create_key(session, wish.name, wish.role)
    return NewKey(id=key_id, name=wish.name, role=wish.role, key=key)


@router.delete("/keys/{key_id}", status_code=204)
def revoke_key(key_id: str, house: HouseDep, _caller: AdminDep) -> None:
    """Forget a key and end the browser sessions it opened."""
    with house.database.writing() as session:
        keys.revoke_key(session, key_id)


@router.post("/login-tokens", status_code=201)
def create_login_token(house: HouseDep, caller: AdminDep) -> LoginLink:
    """Make a link that logs a browser in, once."""
    ttl_s, now_s = house.settings.login_token_s, house.now_s()
    with house.database.writing() as session:
        token = keys.create_login_token(
            session, name=caller.name, role=caller.role, ttl_s=ttl_s, parent=caller.key_id, now_s=now_s
        )
    return LoginLink(url=f"{house.settings.base_url}/login?token={token}", expires_at=utc(now_s + ttl_s))
