"""Login and logout of browsers."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Annotated
from urllib.parse import urlencode, urlsplit

from fastapi import APIRouter, Cookie, Form, Header, Query, Request, Response
from fastapi.responses import RedirectResponse
from starlette.concurrency import run_in_threadpool

from service import browser_sessions
from service.audit import record
from service.auth import Caller
from service.dependencies import (
    COOKIE,
    OFFER,
    AppState,
    AppStateDep,
    CallerOrNoneDep,
    ViewerDep,
    cookie_path,
    session_cookie,
    with_origin,
)
from service.errors import Forbidden, Unauthorized
from service.routes.middleware import address_of
from service.routes.problems import wants_page
from service.schemas.access import AuditAction, Session

router = APIRouter(tags=["access"])
api = APIRouter(tags=["access"])

OldCookie = Annotated[str | None, Cookie(alias=COOKIE, include_in_schema=False)]
FetchSite = Annotated[str | None, Header(alias="Sec-Fetch-Site", include_in_schema=False)]
Token = Annotated[str | None, Query(max_length=200)]
_Spend = Callable[..., tuple[str, Caller]]


@router.get("/login", response_class=RedirectResponse, status_code=303)
async def log_in_by_link(
    request: Request, state: AppStateDep, token: Token = None, site: FetchSite = None, old: OldCookie = None
) -> Response:
    """Exchange a login link for a browser session; without a token, redirect to the login page.

    A link that another site leads to logs nobody in by itself, because the site could log its visitors in as somebody
    else; the login page asks first.
    """
    if token is None:
        return redirect(state)
    if site in ("cross-site", "same-site"):
        return redirect(state, token=token)
    return await _log_in(request, state, browser_sessions.spend_login_token, token, old)


@router.post("/login", response_class=RedirectResponse, status_code=303)
async def log_in_by_form(
    request: Request,
    state: AppStateDep,
    key: Annotated[str, Form(max_length=200)] = "",
    token: Annotated[str, Form(max_length=200)] = "",
    site: FetchSite = None,
    old: OldCookie = None,
) -> Response:
    """Exchange a key or a login token for a browser session; a page that sent an invalid one returns to `/?refused=1`.

    Raises
    ------
    Forbidden
        If the form is not one of our pages.
    """
    _check_own_page(request, state, site)
    try:
        if token:
            return await _log_in(request, state, browser_sessions.spend_login_token, token, old)
        return await _log_in(request, state, browser_sessions.spend_key, key.strip(), old)
    except Unauthorized:
        if wants_page(request):
            return redirect(state, refused="1")
        raise


@router.post("/logout", response_class=RedirectResponse, status_code=303)
def log_out(request: Request, state: AppStateDep, _caller: CallerOrNoneDep, old: OldCookie = None) -> Response:
    """End a browser session and its event streams."""
    if old is not None:
        with state.database.writing() as session:
            caller = browser_sessions.end_session(session, old, now_s=state.now_s(), lifetimes=state.lifetimes)
            if caller is not None:
                caller = with_origin(request, caller)
                record(session, caller, AuditAction.LOG_OUT, caller.id, now_s=state.now_s())
        state.hub.check_credentials()
    request.scope.get("state", {}).pop(OFFER, None)
    response = redirect(state)
    response.delete_cookie(COOKIE, path=cookie_path(state))
    return response


@api.get("/session")
def get_caller(caller: ViewerDep) -> Session:
    """Get the name, the role and the owner of the caller."""
    return Session(name=caller.name, role=caller.role, owner_id=caller.owner_id)


async def _log_in(request: Request, state: AppState, spend: _Spend, secret: str, old: str | None) -> Response:
    """Log in, count a login that fails, and refuse one of an address from which too many have failed."""
    async with counted(state, request):
        cookie = await run_in_threadpool(_open_session, request, state, spend, secret, old)
    return entered(state, cookie, max_age_s=state.settings.session_s)


def _open_session(request: Request, state: AppState, spend: _Spend, secret: str, old: str | None) -> str:
    """Open a session, end the one that the browser had before, and return the cookie."""
    now_s = state.now_s()
    with state.database.writing() as session:
        cookie, caller = spend(session, secret, now_s=now_s, session_s=state.settings.session_s)
        if old is not None:
            browser_sessions.end_session(session, old, now_s=now_s, lifetimes=state.lifetimes)
        record(session, with_origin(request, caller), AuditAction.LOG_IN, caller.id, now_s=now_s)
    return cookie


def _check_own_page(request: Request, state: AppState, site: str | None) -> None:
    """Refuse the form of another site, which could log its visitors in as somebody else.

    Browsers say from where a form comes by Sec-Fetch-Site, and without TLS by Origin. Other clients send neither.
    """
    origin = request.headers.get("origin")
    if site is not None:
        is_own = site in ("same-origin", "none")
    else:
        hosts = (request.headers.get("host"), urlsplit(state.settings.base_url).netloc)
        is_own = origin is None or urlsplit(origin).netloc in hosts
    if not is_own:
        raise Forbidden("the login form of another site is refused; log in on the page of this service")


def redirect(state: AppState, **query: str) -> RedirectResponse:
    """Return a redirect to the page."""
    text = f"?{urlencode(query)}" if query else ""
    return RedirectResponse(f"{state.settings.path_prefix}/{text}", status_code=303)


@asynccontextmanager
async def counted(state: AppState, request: Request) -> AsyncIterator[None]:
    """Count a login that fails, and refuse one of an address from which too many have failed."""
    address = address_of(request)
    await state.rates.check_login(address)
    try:
        yield
    except Unauthorized:
        await state.rates.failed_logins.count(address)
        raise


def entered(state: AppState, cookie: str, *, max_age_s: float, **query: str) -> RedirectResponse:
    """Return the answer that gives a browser its session, and leads it to the page."""
    response = redirect(state, **query)
    response.headers.append("set-cookie", session_cookie(state, cookie, max_age_s=max_age_s))
    return response
