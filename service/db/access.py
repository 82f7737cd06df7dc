"""Queries on keys, login tokens, browser sessions, idempotency keys and the audit log."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from sqlalchemy import ColumnElement, and_, bindparam, delete, func, or_, select, update
from sqlalchemy.orm import Session

from service.db.engine import changed
from service.db.tables import AuditRow, Credential, CredentialKind, IdempotencyKey

LISTED = (CredentialKind.KEY, CredentialKind.WORKER)
"""The credentials that stay when they have expired, until somebody revokes them."""


def credential(session: Session, credential_id: str) -> Credential | None:
    """Return a credential."""
    return session.get(Credential, credential_id)


def valid(session: Session, credential_ids: Iterable[str], *, now_s: float, idle_s: float) -> set[str]:
    """Return those credentials that are still valid: neither revoked, nor ended, nor expired, nor idle."""
    query = select(Credential.id).where(Credential.id.in_([*credential_ids]), ~_is_idle(now_s - idle_s))
    return set(session.scalars(query.where(or_(Credential.expires_s.is_(None), Credential.expires_s >= now_s))))


def keys(session: Session) -> Sequence[Credential]:
    """Return all keys, oldest first; people create them, so there are few."""
    query = select(Credential).where(Credential.kind == CredentialKind.KEY)
    return session.scalars(query.order_by(Credential.created_s).limit(1000)).all()


def worker_keys(session: Session) -> Sequence[Credential]:
    """Return all worker keys, oldest first, also those that have expired and those that were revoked just now."""
    query = select(Credential).where(Credential.kind == CredentialKind.WORKER)
    return session.scalars(query.order_by(Credential.created_s).limit(10_000)).all()


def revoke_worker_key(session: Session, key_id: str, *, now_s: float) -> bool:
    """Revoke a worker key; return whether it existed. Its row stays until its user at the broker is gone."""
    statement = update(Credential).where(Credential.id == key_id, Credential.kind == CredentialKind.WORKER)
    return changed(session, statement.where(Credential.revoked_s.is_(None)).values(revoked_s=now_s)) == 1


def forget_broker_user(session: Session, key_id: str) -> None:
    """Store that a worker key has no user at the broker."""
    changed(session, update(Credential).where(Credential.id == key_id).values(has_broker_user=False))


def delete_revoked_worker_keys(session: Session, gone: Iterable[str]) -> None:
    """Delete worker keys that were revoked and have no user at the broker: those that never had one, and `gone`."""
    is_gone = or_(~Credential.has_broker_user, Credential.id.in_([*gone]))
    of_kind = Credential.kind == CredentialKind.WORKER
    changed(session, delete(Credential).where(of_kind, Credential.revoked_s.is_not(None), is_gone))


def sessions(session: Session, *, now_s: float, idle_s: float) -> Sequence[Credential]:
    """Return the open browser sessions, newest first and at most 1000."""
    query = select(Credential).where(Credential.kind == CredentialKind.SESSION, Credential.expires_s >= now_s)
    query = query.where(~_is_idle(now_s - idle_s)).order_by(Credential.created_s.desc())
    return session.scalars(query.limit(1000)).all()


def revoke(session: Session, key_id: str) -> bool:
    """Delete a key, its login links and its browser sessions; return whether the key existed."""
    changed(session, delete(Credential).where(Credential.parent == key_id))
    found = delete(Credential).where(Credential.id == key_id, Credential.kind == CredentialKind.KEY)
    return changed(session, found) == 1


def spend(session: Session, credential_id: str) -> bool:
    """Delete a credential; of several concurrent callers, only one gets True."""
    return changed(session, delete(Credential).where(Credential.id == credential_id)) == 1


def offer_token(session: Session, session_id: str, present: str, new: str, *, now_s: float, overlap_s: float) -> bool:
    """Store the digest of the next token of a session; False if it has another token, or was offered one just now."""
    is_free = or_(Credential.next_s.is_(None), Credential.next_s <= now_s - overlap_s)
    statement = update(Credential).where(Credential.id == session_id, Credential.secret_sha256 == present, is_free)
    return changed(session, statement.values(next_sha256=new, next_s=now_s)) == 1


def take_token(session: Session, session_id: str, new: str, *, now_s: float) -> None:
    """Let the next token of a session, which its browser has sent, replace the present one."""
    statement = update(Credential).where(Credential.id == session_id, Credential.next_sha256 == new)
    changed(
        session,
        statement.values(
            old_sha256=Credential.secret_sha256, secret_sha256=new, next_sha256=None, next_s=None, renewed_s=now_s
        ),
    )


def set_used(session: Session, used_s: Mapping[str, float]) -> None:
    """Store when credentials were used last; those that are gone are left out, and another process may know better."""
    is_later = or_(Credential.used_s.is_(None), Credential.used_s < bindparam("at_s"))
    statement = update(Credential).where(Credential.id == bindparam("of_id"), is_later).values(used_s=bindparam("at_s"))
    if used_s:
        rows = [{"of_id": credential_id, "at_s": at_s} for credential_id, at_s in sorted(used_s.items())]
        session.connection().execute(statement, rows)


def audit_page(
    session: Session, *, before: int | None, limit: int, action: str | None, name: str | None, subject: str | None
) -> Sequence[AuditRow]:
    """Return entries of the audit log with ids below `before`, newest first.

    Parameters
    ----------
    action, name, subject
        Only entries of this action, of the key with this name or this id, and of this subject.
    """
    query = select(AuditRow).order_by(AuditRow.id.desc()).limit(limit)
    if before is not None:
        query = query.where(AuditRow.id < before)
    if action is not None:
        query = query.where(AuditRow.action == action)
    if name is not None:
        query = query.where(or_(AuditRow.name == name, AuditRow.key_id == name))
    if subject is not None:
        query = query.where(AuditRow.subject == subject)
    return session.scalars(query).all()


def idempotency(session: Session, caller: str, key: str) -> IdempotencyKey | None:
    """Return the earlier use of an Idempotency-Key."""
    return session.get(IdempotencyKey, (caller, key))


def delete_expired(session: Session, *, now_s: float, idle_s: float, idempotency_s: float, audit_s: float) -> None:
    """Delete login links and sessions that have expired, and idempotency keys and audit entries older than given.

    Expired keys stay in the list until somebody revokes them.
    """
    is_expired = or_(Credential.expires_s < now_s, _is_idle(now_s - idle_s))
    changed(session, delete(Credential).where(Credential.kind.not_in(LISTED), is_expired))
    changed(session, delete(AuditRow).where(AuditRow.at_s < now_s - audit_s))
    changed(session, delete(IdempotencyKey).where(IdempotencyKey.created_s < now_s - idempotency_s))


def _is_idle(since_s: float) -> ColumnElement[bool]:
    used_s = func.coalesce(Credential.used_s, Credential.created_s)
    return and_(Credential.kind == CredentialKind.SESSION, used_s < since_s)
