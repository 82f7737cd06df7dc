"""Keys, login tokens, browser sessions, idempotency keys."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from service.db.engine import changed
from service.db.tables import Credential, CredentialKind, IdempotencyKey


def credential(session: Session, credential_id: str) -> Credential | None:
    """Return a credential."""
    return session.get(Credential, credential_id)


def keys(session: Session) -> Sequence[Credential]:
    """Return every key, oldest first; people make them, so they are few."""
    query = select(Credential).where(Credential.kind == CredentialKind.KEY)
    return session.scalars(query.order_by(Credential.created_s).limit(1000)).all()


def revoke(session: Session, key_id: str) -> bool:
    """Forget a key and the browser sessions that it opened."""
    changed(session, delete(Credential).where(Credential.parent == key_id))
    found = delete(Credential).where(Credential.id == key_id, Credential.kind == CredentialKind.KEY)
    return changed(session, found) == 1


def spend(session: Session, credential_id: str) -> bool:
    """Use a credential up; True for the one caller who did."""
    return changed(session, delete(Credential).where(Credential.id == credential_id)) == 1


def idempotency(session: Session, caller: str, key: str) -> IdempotencyKey | None:
    """Return what an Idempotency-Key was used for."""
    return session.get(IdempotencyKey, (caller, key))


def forget_old(session: Session, *, now_s: float, idempotency_s: float) -> None:
    """Forget what has expired."""
    changed(session, delete(Credential).where(Credential.expires_s < now_s))
    changed(session, delete(IdempotencyKey).where(IdempotencyKey.created_s < now_s - idempotency_s))
