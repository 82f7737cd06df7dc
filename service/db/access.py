"""Queries on keys, login tokens, browser sessions and idempotency keys."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sqlalchemy import delete, or_, select
from sqlalchemy.orm import Session

from service.db.engine import changed
from service.db.tables import Credential, CredentialKind, IdempotencyKey


def credential(session: Session, credential_id: str) -> Credential | None:
    """Return a credential."""
    return session.get(Credential, credential_id)


def valid(session: Session, credential_ids: Iterable[str], *, now_s: float) -> set[str]:
    """Return those credentials that are still valid: neither revoked, nor ended, nor expired."""
    query = select(Credential.id).where(Credential.id.in_([*credential_ids]))
    return set(session.scalars(query.where(or_(Credential.expires_s.is_(None), Credential.expires_s >= now_s))))


def keys(session: Session) -> Sequence[Credential]:
    """Return all keys, oldest first; people create them, so there are few."""
    query = select(Credential).where(Credential.kind == CredentialKind.KEY)
    return session.scalars(query.order_by(Credential.created_s).limit(1000)).all()


def revoke(session: Session, key_id: str) -> bool:
    """Delete a key and the browser sessions that it opened; return whether the key existed."""
    changed(session, delete(Credential).where(Credential.parent == key_id))
    found = delete(Credential).where(Credential.id == key_id, Credential.kind == CredentialKind.KEY)
    return changed(session, found) == 1


def spend(session: Session, credential_id: str) -> bool:
    """Delete a credential; of several concurrent callers, only one gets True."""
    return changed(session, delete(Credential).where(Credential.id == credential_id)) == 1


def idempotency(session: Session, caller: str, key: str) -> IdempotencyKey | None:
    """Return the earlier use of an Idempotency-Key."""
    return session.get(IdempotencyKey, (caller, key))


def delete_expired(session: Session, *, now_s: float, idempotency_s: float) -> None:
    """Delete expired credentials, and idempotency keys older than `idempotency_s`."""
    changed(session, delete(Credential).where(Credential.expires_s < now_s))
    changed(session, delete(IdempotencyKey).where(IdempotencyKey.created_s < now_s - idempotency_s))
