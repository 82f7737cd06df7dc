"""The dependencies of routes: the state of the application, and the caller.

A dependency that is no coroutine runs in a thread, and each thread of a request waits for Python's lock once more. So
the dependencies that do not read the database are coroutines, and a route opens its session in its own thread.
"""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field, replace
from typing import Annotated, cast

import structlog
from fastapi import Cookie, Depends, Header, Path, Query, Request, Response
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session
from starlette.concurrency import run_in_threadpool

from service import auth as keys
from service import browser_sessions
from service.api.waits import Outlook
from service.artifact_links import ArtifactLinks
from service.audit import record
from service.auth import Caller
from service.broker_stream import Stream
from service.browser_sessions import Found, Lifetimes, TokenAge
from service.db import access as access_rows
from service.db import jobs as job_rows
from service.db.engine import Database
from service.errors import Forbidden, NotFound, Unauthorized
from service.events.hub import EventHub
from service.events.wakeup import Wakeup
from service.health import Checks
from service.jobs.artifact_guard import ArtifactGuard
from service.last_use import LastUse
from service.metrics.access import MonitorAccess
from service.metrics.readings import FarmReader
from service.ports import Parts
from service.previews.run import Previews
from service.query_names import check_query
from service.rate_limits import RateLimits
from service.roster import RosterCache
from service.schemas.access import AuditAction, Role
from service.schemas.answer import MAX_LIMIT
from service.settings import Settings
from service.viewing.process_pool import ProcessPool
from service.viewing.queue import PictureQueue
from service.worker_keys.broker_users import BrokerUsers
from service.worker_keys.registry import WorkerKeys

log = structlog.get_logger("service.access")

COOKIE = "lippmann_session"
OFFER = "offered_cookie"
"""The name under which the state of a request holds a new cookie, and when it was made."""
COPIED = "an old token of the session was sent, so somebody has a copy"
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})


@dataclass(frozen=True)
class AppState:
    """The objects that live as long as the application."""

    settings: Settings
    parts: Parts
    database: Database
    wakeup: Wakeup
    hub: EventHub
    stream: Stream
    checks: Checks
    processes: ProcessPool
    guard: ArtifactGuard
    roster: RosterCache
    last_use: LastUse
    rates: RateLimits
    pictures: PictureQueue
    previews: Previews
    links: ArtifactLinks
    monitors: MonitorAccess
    farm_reader: FarmReader
    broker_users: BrokerUsers
    worker_keys: WorkerKeys
    clock: Callable[[], float] = field(default=time.time)

    def now_s(self) -> float:
        """Return seconds since 1970, UTC."""
        return self.clock()

    @property
    def lifetimes(self) -> Lifetimes:
        """The times after which browser sessions end, and their tokens are replaced."""
        return Lifetimes(idle_s=self.settings.session_idle_s, renew_s=self.settings.session_renew_s)

    def outlook(self) -> Outlook:
        """Return what decides how long jobs wait and is not in the database."""
        return Outlook(self.now_s(), self.settings, self.roster.latest())


async def get_state(request: Request) -> AppState:
    """Return the state of the application."""
    return cast(AppState, request.app.state.lippmann)


AppStateDep = Annotated[AppState, Depends(get_state)]


async def identify_caller(
    request: Request,
    state: AppStateDep,
    authorization: Annotated[str | None, Header(include_in_schema=False)] = None,
    x_lippmann_request: Annotated[str | None, Header(include_in_schema=False)] = None,
    lippmann_session: Annotated[str | None, Cookie(include_in_schema=False)] = None,
) -> Caller | None:
    """Return the caller; None without credentials.

    Raises
    ------
    Unauthorized
        If the request has an invalid key.
    Forbidden
        If a browser sends a request that changes something without the header of our pages.
    """
    if authorization is None and lippmann_session is None:
        return None
    return await run_in_threadpool(
        find_caller, request, state, authorization, lippmann_session, x_lippmann_request=x_lippmann_request
    )


def find_caller(
    request: Request, state: AppState, authorization: str | None, cookie: str | None, *, x_lippmann_request: str | None
) -> Caller | None:
    """Find the caller in the database; see `identify_caller`."""
    with state.database.reading() as session:
        if authorization is not None:
            return _known(request, state, _by_header(session, authorization, state.now_s()))
        if cookie is None:
            return None
        found = browser_sessions.find_session(session, cookie, now_s=state.now_s(), lifetimes=state.lifetimes)
    if found is None or not _stays_open(request, state, found):
        return None
    if request.method not in SAFE_METHODS and x_lippmann_request != "1":
        raise Forbidden("requests from a browser that change something need the header 'X-Lippmann-Request: 1'")
    return _known(request, state, found.caller)


def _stays_open(request: Request, state: AppState, found: Found) -> bool:
    """Take the next step of the tokens of a session; return False if it ended because its token was copied."""
    now_s = state.now_s()
    try:
        if found.age in (TokenAge.DUE, TokenAge.NEXT):
            with state.database.writing() as session:
                cookie = browser_sessions.renew(session, found, now_s=now_s)
            if cookie is not None:
                offer_cookie(request, state, cookie, max_age_s=(found.row.expires_s or now_s) - now_s)
        elif found.age is TokenAge.COPIED:
            with state.database.writing() as session:
                if access_rows.spend(session, found.row.id):
                    caller = with_origin(request, found.caller)
                    record(session, caller, AuditAction.END_SESSION, caller.id, now_s=now_s, detail=COPIED)
            state.hub.check_credentials()
    except SQLAlchemyError as error:
        # While the database cannot be written, sessions go on with the tokens that they have.
        log.warning("the token of a session cannot be replaced", error=repr(error))
    return found.age is not TokenAge.COPIED


def session_cookie(state: AppState, cookie: str, *, max_age_s: float) -> str:
    """Return the header that gives a browser the cookie of a session."""
    response = Response()
    response.set_cookie(
        COOKIE,
        cookie,
        max_age=int(max_age_s),
        path=cookie_path(state),
        httponly=True,
        samesite="strict",
        secure=state.settings.base_url.startswith("https://"),
    )
    return response.headers["set-cookie"]


def cookie_path(state: AppState) -> str:
    """Return the path of the cookie of a session."""
    return state.settings.path_prefix or "/"


def offer_cookie(request: Request, state: AppState, cookie: str, *, max_age_s: float) -> None:
    """Send a new cookie with the answer to a request, whatever the route answers; see `routes.middleware`."""
    header = session_cookie(state, cookie, max_age_s=max_age_s).encode("ascii")
    request.scope.setdefault("state", {})[OFFER] = (header, time.monotonic())


def with_origin(request: Request, caller: Caller) -> Caller:
    """Return a caller with the address and the id of a request, for the audit log."""
    address = request.client.host if request.client is not None else ""
    return replace(caller, address=address, request_id=request.scope.get("state", {}).get("request_id", ""))


def _known(request: Request, state: AppState, caller: Caller) -> Caller:
    state.last_use.note(caller.key_id, caller.id, now_s=state.now_s())
    return with_origin(request, caller)


async def get_caller_or_none(
    request: Request,
    state: AppStateDep,
    caller: Annotated[Caller | None, Depends(identify_caller, scope="function")],
) -> Caller | None:
    """Return the caller, whose request is counted; None without credentials.

    Raises
    ------
    TooManyRequests
        If the key sends too many requests.
    Invalid
        If the query has parameters that the route does not have. Without credentials, nobody learns which it has.
    """
    if caller is not None:
        structlog.contextvars.bind_contextvars(key=caller.key_id)  # every line about the rest of the request carries it
        await state.rates.by_key.check(caller.key_id, "the key sends too many requests")
        await check_query(request)
    return caller


CallerOrNoneDep = Annotated[Caller | None, Depends(get_caller_or_none, scope="function")]


def require(role: Role) -> Callable[[Caller | None], Awaitable[Caller]]:
    """Return a dependency that requires a role."""

    async def check(caller: CallerOrNoneDep) -> Caller:
        if caller is None:
            raise Unauthorized
        if not caller.role.allows(role):
            raise Forbidden(f"this requires the role {role}, but the key {caller.name!r} has the role {caller.role}")
        return caller

    return check


require_viewer = require(Role.VIEWER)
require_submitter = require(Role.SUBMITTER)
require_admin = require(Role.ADMIN)
ViewerDep = Annotated[Caller, Depends(require_viewer)]
SubmitterDep = Annotated[Caller, Depends(require_submitter)]
AdminDep = Annotated[Caller, Depends(require_admin)]


async def get_scope(state: AppStateDep, caller: ViewerDep) -> str | None:
    """Return the owner whose jobs and scenes the caller sees, besides shared jobs; None for those of all owners."""
    return caller.scope(sharing=state.settings.sharing)


ScopeDep = Annotated[str | None, Depends(get_scope, scope="function")]
_JobPath = Annotated[str, Path(description="The id of the job.")]


async def get_visible_job(job_id: _JobPath, state: AppStateDep, scope: ScopeDep) -> str:
    """Return the id of a job that the caller may see.

    Raises
    ------
    NotFound
        If the job does not exist or is hidden from the caller.
    """
    if scope is not None:
        await run_in_threadpool(check_visible, state, job_id, scope)
    return job_id


def check_visible(state: AppState, job_id: str, scope: str | None) -> None:
    """Raise an error unless a job is in a scope; in the scope of all owners, whoever reads the job finds out.

    Raises
    ------
    NotFound
        If the job does not exist or is hidden from the caller.
    """
    if scope is None:
        return
    found = _owner_of(state, job_id)
    if found is None or not (found[1] or found[0] == scope):
        raise NotFound(f"there is no job {job_id!r}")


def get_own_job(job_id: _JobPath, state: AppStateDep, caller: SubmitterDep, scope: ScopeDep) -> str:
    """Return the id of a job that the caller may change.

    Raises
    ------
    NotFound
        If the job does not exist or is hidden from the caller.
    Forbidden
        If the job belongs to another owner.
    """
    owner_id, is_shared = _owner_of(state, job_id) or (None, False)
    if owner_id is None or not (is_shared or scope in (None, owner_id)):
        raise NotFound(f"there is no job {job_id!r}")
    if not caller.may_change(owner_id):
        raise Forbidden(f"the job belongs to {owner_id!r}, and only its owner and admins change it")
    return job_id


JobId = Annotated[str, Depends(get_visible_job, scope="function")]
OwnJobId = Annotated[str, Depends(get_own_job, scope="function")]

LimitQuery = Annotated[int, Query(ge=1, le=MAX_LIMIT, description="The largest number of items in the page.")]
CursorQuery = Annotated[str | None, Query(max_length=200, description="The `next_cursor` of the page before.")]


def _owner_of(state: AppState, job_id: str) -> tuple[str, bool] | None:
    with state.database.reading() as session:
        return job_rows.owner_of(session, job_id)


def _by_header(session: Session, authorization: str, now_s: float) -> Caller:
    scheme, _, key = authorization.partition(" ")
    if scheme.lower() != "bearer":
        raise Unauthorized("expected 'Authorization: Bearer <key>'")
    caller = keys.caller_of_key(session, key.strip(), now_s=now_s)
    if caller is None:
        raise Unauthorized("this key is unknown, was revoked or has expired")
    return caller
