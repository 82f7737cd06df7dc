"""What a route asks for: session, settings, caller, and the things that live as long as the application."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Annotated, cast

from fastapi import Cookie, Depends, Header, Query, Request
from sqlalchemy.orm import Session

from service import auth as keys
from service.auth import Caller
from service.broker_stream import Stream
from service.db.engine import Database
from service.errors import Forbidden, Unauthorized
from service.events.wakeup import Bell
from service.health import Checks
from service.ports import Parts
from service.schemas.access import Role
from service.schemas.answer import MAX_LIMIT
from service.settings import Settings
from service.viewing.frames import Sheets

COOKIE = "lippmann_session"
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})


@dataclass(frozen=True)
class House:
    """What lives as long as the application."""

    settings: Settings
    parts: Parts
    database: Database
    bell: Bell
    stream: Stream
    checks: Checks
    sheets: Sheets
    clock: Callable[[], float] = field(default=time.time)

    def now_s(self) -> float:
        """Return seconds since 1970, UTC."""
        return self.clock()


def get_house(request: Request) -> House:
    """Return what lives as long as the application."""
    return cast(House, request.app.state.house)


HouseDep = Annotated[House, Depends(get_house)]


def get_session(house: HouseDep) -> Iterator[Session]:
    """Lend a session that only reads."""
    with house.database.reading() as session:
        yield session


# Given back before the answer is sent, so that a slow reader of a file holds no connection.
SessionDep = Annotated[Session, Depends(get_session, scope="function")]


def get_caller_or_none(
    request: Request,
    house: HouseDep,
    authorization: Annotated[str | None, Header(include_in_schema=False)] = None,
    x_lippmann_request: Annotated[str | None, Header(include_in_schema=False)] = None,
    lippmann_session: Annotated[str | None, Cookie(include_in_schema=False)] = None,
) -> Caller | None:
    """Return who is calling, None for nobody.

    Raises
    ------
    Unauthorized
        If a key was shown that is none.
    Forbidden
        If a browser wants to change something and does not say that a page of ours asked it to.
    """
    with house.database.reading() as session:
        if authorization is not None:
            return _by_header(session, authorization, house.now_s())
        if lippmann_session is None:
            return None
        caller = keys.caller_of_cookie(session, lippmann_session, now_s=house.now_s())
    if caller is not None and request.method not in SAFE_METHODS and x_lippmann_request != "1":
        raise Forbidden("requests of a browser that change something need the header 'X-Lippmann-Request: 1'")
    return caller


CallerOrNoneDep = Annotated[Caller | None, Depends(get_caller_or_none, scope="function")]


def require(role: Role) -> Callable[[Caller | None], Caller]:
    """Return a dependency that lets in who has this role."""

    def check(caller: CallerOrNoneDep) -> Caller:
        if caller is None:
            raise Unauthorized
        if not caller.role.allows(role):
            raise Forbidden(f"this needs the role {role}, and the key {caller.name!r} has the role {caller.role}")
        return caller

    return check


ViewerDep = Annotated[Caller, Depends(require(Role.VIEWER))]
SubmitterDep = Annotated[Caller, Depends(require(Role.SUBMITTER))]
AdminDep = Annotated[Caller, Depends(require(Role.ADMIN))]

LimitQuery = Annotated[int, Query(ge=1, le=MAX_LIMIT, description="The longest page wanted.")]
CursorQuery = Annotated[str | None, Query(max_length=200, description="`next_cursor` of the page before.")]


def _by_header(session: Session, authorization: str, now_s: float) -> Caller:
    scheme, _, key = authorization.partition(" ")
    if scheme.lower() != "bearer":
        raise Unauthorized("expected 'Authorization: Bearer <key>'")
    caller = keys.caller_of_key(session, key.strip(), now_s=now_s)
    if caller is None:
        raise Unauthorized("this key is not known, or was revoked")
    return caller
