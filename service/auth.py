"""Keys and login links, and what they share with browser sessions. Only the SHA-256 of a secret is stored."""

from __future__ import annotations

import hashlib
import hmac
import secrets
import time
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from service.db import access as access_rows
from service.db.tables import ADMIN_OWNER, Credential, CredentialKind
from service.errors import NotFound
from service.schemas.access import KeyLimits, Role

KEY_PREFIX = "lip"
SECRET_BYTES = 32
MAX_SECRET = 200
"""The longest credential that is looked at, in characters."""
NO_LIMITS = KeyLimits()
"""The limits of a key that has those of the farm."""


@dataclass(frozen=True)
class Caller:
    """The caller of a request: a credential, and where the request comes from."""

    id: str
    key_id: str
    name: str
    role: Role
    owner_id: str
    """The owner of the caller's jobs and scenes."""
    limits: KeyLimits = NO_LIMITS
    address: str = ""
    request_id: str = ""

    def may_change(self, owner_id: str) -> bool:
        """Return whether the caller may change a job or a scene of an owner."""
        return self.role is Role.ADMIN or self.owner_id == owner_id

    def scope(self, *, sharing: bool) -> str | None:
        """Return the owner whose jobs and scenes the caller sees; None for those of all owners."""
        return None if sharing or self.role is Role.ADMIN else self.owner_id


def create_key(
    session: Session,
    name: str,
    role: Role,
    *,
    owner_id: str | None = None,
    expires_s: float | None = None,
    limits: KeyLimits | None = None,
    now_s: float | None = None,
) -> tuple[str, str]:
    """Create a key, and return (id, key); the key cannot be retrieved later. Without an owner it is its own."""
    made_s = time.time() if now_s is None else now_s
    row, secret = create_credential(
        session, CredentialKind.KEY, name, role, owner_id=owner_id, expires_s=expires_s, limits=limits, now_s=made_s
    )
    return row.id, f"{KEY_PREFIX}_{row.id}_{secret}"


def list_keys(session: Session) -> Sequence[Credential]:
    """Return all keys, also those that have expired, without their secrets."""
    return access_rows.keys(session)


def revoke_key(session: Session, key_id: str) -> None:
    """Delete a key, and with it the login links that it made and the browser sessions that it opened.

    Raises
    ------
    NotFound
        If the key does not exist.
    """
    if not access_rows.revoke(session, key_id):
        raise NotFound(f"there is no key {key_id!r}")


def create_login_token(
    session: Session,
    *,
    name: str = "browser",
    role: Role = Role.ADMIN,
    ttl_s: float = 900.0,
    owner_id: str = ADMIN_OWNER,
    parent: str | None = None,
    now_s: float | None = None,
) -> str:
    """Create a token that opens one browser session through `/login?token=`."""
    made_s = time.time() if now_s is None else now_s
    row, secret = create_credential(
        session, CredentialKind.LOGIN, name, role, owner_id=owner_id, expires_s=made_s + ttl_s, parent=parent,
        now_s=made_s,
    )  # fmt: skip
    return f"{row.id}.{secret}"


def caller_of_key(session: Session, key: str, *, now_s: float) -> Caller | None:
    """Return the owner of a key."""
    found = find_key(session, key, now_s=now_s)
    return None if found is None else as_caller(found)


def caller_of_id(session: Session, credential_id: str, *, now_s: float, idle_s: float) -> Caller | None:
    """Return the owner of a key or a browser session by its id, for something that it signed earlier."""
    if not access_rows.valid(session, [credential_id], now_s=now_s, idle_s=idle_s):
        return None
    found = access_rows.credential(session, credential_id)
    return None if found is None or found.kind not in (CredentialKind.KEY, CredentialKind.SESSION) else as_caller(found)


def find_key(session: Session, key: str, *, now_s: float) -> Credential | None:
    """Return the row of a key; None if the key is unknown, was revoked or has expired."""
    prefix, _, rest = key.partition("_")
    presented = rest.replace("_", ".", 1) if prefix == KEY_PREFIX else ""
    return verify(session, CredentialKind.KEY, presented, now_s=now_s)


def verify(session: Session, kind: CredentialKind, presented: str, *, now_s: float) -> Credential | None:
    """Return the row of a credential that was presented as `id.secret`; None if it is not valid."""
    credential_id, _, secret = presented.partition(".")
    found = access_rows.credential(session, credential_id) if credential_id and len(presented) <= MAX_SECRET else None
    # The digests are compared even for an unknown id, so that the response time does not reveal which ids exist.
    is_right = hmac.compare_digest(
        digest_of_secret(secret), found.secret_sha256 if found else digest_of_secret("")
    )  # fmt: skip
    if found is None or not is_right or found.kind is not kind:
        return None
    return None if found.expires_s is not None and found.expires_s < now_s else found


def create_credential(
    session: Session,
    kind: CredentialKind,
    name: str,
    role: Role,
    *,
    now_s: float,
    owner_id: str | None = None,
    expires_s: float | None = None,
    limits: KeyLimits | None = None,
    parent: str | None = None,
) -> tuple[Credential, str]:
    """Store a credential, and return its row and its secret. Without an owner it is its own."""
    secret, credential_id = new_secret(), secrets.token_hex(6)
    row = Credential(
        id=credential_id,
        kind=kind,
        name=name,
        role=Role(role).value,
        owner_id=credential_id if owner_id is None else owner_id,
        secret_sha256=digest_of_secret(secret),
        parent=parent,
        created_s=now_s,
        expires_s=expires_s,
        limits=None if limits is None else limits.model_dump(exclude_none=True) or None,
    )
    session.add(row)
    session.flush()
    return row, secret


def as_caller(found: Credential) -> Caller:
    """Return who calls with a credential."""
    is_session = found.kind is CredentialKind.SESSION
    key_id = (found.parent or found.id) if is_session else found.id
    return Caller(
        id=found.id,
        key_id=key_id,
        name=found.name,
        role=Role(found.role),
        owner_id=found.owner_id,
        limits=limits_of(found),
    )


def limits_of(found: Credential) -> KeyLimits:
    """Return the limits of a key, or of a session that has those of its key."""
    return KeyLimits.model_validate(found.limits or {}, extra="ignore")


def new_secret() -> str:
    """Return a new secret of 256 bits."""
    return secrets.token_urlsafe(SECRET_BYTES)


def digest_of_secret(secret: str) -> str:
    """Return what is stored of a secret."""
    return hashlib.sha256(secret.encode()).hexdigest()
