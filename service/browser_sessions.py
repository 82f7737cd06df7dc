"""Browser sessions: login, logout, and the token in the cookie of a browser, which is replaced from time to time.

A session keeps its id while its tokens change. The next token goes out with an answer. The session keeps the present
token until the browser has sent the next one, since an answer may be lost. It accepts the old one for `OVERLAP_S` more,
since requests may be under way. Whoever sends it later has kept a copy: the session ends.
"""

from __future__ import annotations

import hmac
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from sqlalchemy.orm import Session

from service import auth
from service.auth import Caller
from service.db import access as access_rows
from service.db.tables import Credential, CredentialKind
from service.errors import NotFound, Unauthorized
from service.schemas.access import KeyLimits, Role

OVERLAP_S = 60.0
"""The time for which an old token is accepted, and after which another next token is made if the last one got lost."""


@dataclass(frozen=True)
class Lifetimes:
    """The time for which a session lasts without a request, and with each of its tokens, in seconds."""

    idle_s: float
    renew_s: float


class TokenAge(Enum):
    """Which token of a session a browser has sent."""

    PRESENT = "the present one"
    DUE = "the present one, and it is time for the next"
    NEXT = "the next one, for the first time"
    OLD = "the one before, and requests may still be under way"
    COPIED = "the one before, long after it was replaced"


@dataclass(frozen=True)
class Found:
    """A session, and which of its tokens was sent."""

    row: Credential
    age: TokenAge

    @property
    def caller(self) -> Caller:
        """The user of the session."""
        return auth.as_caller(self.row)


def find_session(session: Session, cookie: str, *, now_s: float, lifetimes: Lifetimes) -> Found | None:
    """Return the session of a cookie; None if it does not exist, has ended or has expired."""
    session_id, _, secret = cookie.partition(".")
    row = access_rows.credential(session, session_id) if session_id and len(cookie) <= auth.MAX_SECRET else None
    sent = auth.digest_of_secret(secret)
    if row is None or row.kind is not CredentialKind.SESSION:
        return None
    if row.expires_s is None or row.expires_s < now_s or (row.used_s or row.created_s) + lifetimes.idle_s < now_s:
        return None
    if hmac.compare_digest(sent, row.secret_sha256):
        since_s = row.created_s if row.renewed_s is None else row.renewed_s
        is_due = now_s - since_s >= lifetimes.renew_s and (row.next_s is None or now_s - row.next_s >= OVERLAP_S)
        return Found(row, TokenAge.DUE if is_due else TokenAge.PRESENT)
    if hmac.compare_digest(sent, row.next_sha256 or ""):
        return Found(row, TokenAge.NEXT)
    if hmac.compare_digest(sent, row.old_sha256 or ""):
        is_copy = now_s - (row.renewed_s or 0.0) > OVERLAP_S
        return Found(row, TokenAge.COPIED if is_copy else TokenAge.OLD)
    return None


def renew(session: Session, found: Found, *, now_s: float) -> str | None:
    """Take the next step of the tokens of a session, and return the cookie with a new token, if there is one."""
    row = found.row
    if found.age is TokenAge.NEXT and row.next_sha256 is not None:
        access_rows.take_token(session, row.id, row.next_sha256, now_s=now_s)
    if found.age is not TokenAge.DUE:
        return None
    secret = auth.new_secret()
    digest = auth.digest_of_secret(secret)
    is_first = access_rows.offer_token(
        session, row.id, row.secret_sha256, digest, now_s=now_s, overlap_s=OVERLAP_S
    )  # fmt: skip
    return f"{row.id}.{secret}" if is_first else None


def spend_login_token(session: Session, token: str, *, now_s: float, session_s: float) -> tuple[str, Caller]:
    """Exchange a login token, once, for the cookie of a browser session.

    Raises
    ------
    Unauthorized
        If the token was used, has expired or never existed.
    """
    found = auth.verify(session, CredentialKind.LOGIN, token, now_s=now_s)
    if found is None or not access_rows.spend(session, found.id):
        raise Unauthorized("this login link was used or has expired; request a new one")
    return _open_for(session, found, found.parent, now_s=now_s, session_s=session_s)


def spend_key(session: Session, key: str, *, now_s: float, session_s: float) -> tuple[str, Caller]:
    """Exchange a key for the cookie of a browser session; the key stays valid, and the session ends with it.

    Raises
    ------
    Unauthorized
        If the key is unknown.
    """
    found = auth.find_key(session, key, now_s=now_s)
    if found is None:
        raise Unauthorized("this key is unknown")
    return _open_for(session, found, found.id, now_s=now_s, session_s=session_s)


def open_session(
    session: Session,
    name: str,
    role: Role,
    *,
    owner_id: str,
    now_s: float,
    session_s: float,
    parent: str | None = None,
    limits: KeyLimits | None = None,
) -> tuple[str, Caller]:
    """Open a session, and return its cookie and its user."""
    row, secret = auth.create_credential(
        session, CredentialKind.SESSION, name, role, owner_id=owner_id, expires_s=now_s + session_s, limits=limits,
        parent=parent, now_s=now_s,
    )  # fmt: skip
    return f"{row.id}.{secret}", auth.as_caller(row)


def end_session(session: Session, cookie: str, *, now_s: float, lifetimes: Lifetimes) -> Caller | None:
    """End the session of a cookie, and return whose it was; None if there is no such session."""
    found = find_session(session, cookie, now_s=now_s, lifetimes=lifetimes)
    if found is None:
        return None
    access_rows.spend(session, found.row.id)
    return found.caller


def list_sessions(session: Session, *, now_s: float, lifetimes: Lifetimes) -> Sequence[Credential]:
    """Return the open sessions, newest first."""
    return access_rows.sessions(session, now_s=now_s, idle_s=lifetimes.idle_s)


def end_session_called(session: Session, session_id: str) -> None:
    """End a session.

    Raises
    ------
    NotFound
        If there is no such session.
    """
    row = access_rows.credential(session, session_id)
    if row is None or row.kind is not CredentialKind.SESSION or not access_rows.spend(session, session_id):
        raise NotFound(f"there is no browser session {session_id!r}")


def _open_for(
    session: Session, found: Credential, parent: str | None, *, now_s: float, session_s: float
) -> tuple[str, Caller]:
    key = access_rows.credential(session, parent) if parent is not None else None
    if key is not None and key.expires_s is not None:
        session_s = min(session_s, key.expires_s - now_s)
    return open_session(
        session, found.name, Role(found.role), owner_id=found.owner_id, parent=parent,
        limits=auth.limits_of(key or found), now_s=now_s, session_s=session_s,
    )  # fmt: skip
