"""Login and logout of browsers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated
from urllib.parse import urlencode, urlsplit

from fastapi import APIRouter, Cookie, Form, Header, Query, Request, Response
from fastapi.responses import RedirectResponse
from starlette.concurrency import run_in_threadpool

from service import auth as keys
from service.audit import record
from service.auth import Caller
from service.dependencies import COOKIE, AppState, AppStateDep, CallerOrNoneDep, ViewerDep, with_origin
from service.errors import Forbidden, Unauthorized
from service.routes.middleware import address_of
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
        return _redirect(state)
    if site in ("cross-site", "same-site"):
        return _redirect(state, token=token)
    return await _log_in(request, state, keys.spend_login_token, token, old)


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
            return await _log_in(request, state, keys.spend_login_token, token, old)
        return await _log_in(request, state, keys.spend_key, key.strip(), old)
    except Unauthorized:
        if "text/html" in request.headers.get("accept", ""):
            return _redirect(state, refused="1")
        raise


@router.post("/logout", response_class=RedirectResponse, status_code=303)
def log_out(request: Request, state: AppStateDep, _caller: CallerOrNoneDep, old: OldCookie = None) -> Response:
    """End a browser session and its event streams."""
    if old is not None:
        with state.database.writing() as session:
            caller = keys.end_session(session, old, now_s=state.now_s())
            if caller is not None:
                caller = with_origin(request, caller)
                record(session, caller, AuditAction.LOG_OUT, caller.id, now_s=state.now_s())
        state.hub.check_credentials()
    response = _redirect(state)
    response.delete_cookie(COOKIE, path=_cookie_path(state))
    return response


@api.get("/session")
def get_caller(caller: ViewerDep) -> Session:
    """Get the name, the role and the owner of the caller."""
    return Session(name=caller.name, role=caller.role, owner_id=caller.owner_id)


async def _log_in(request: Request, state: AppState, spend: _Spend, secret: str, old: str | None) -> Response:
    """Log in, count a login that fails, and refuse one of an address from which too many have failed."""
    address = address_of(request)
    await state.rates.check_login(address)
    try:
        cookie = await run_in_threadpool(_open_session, request, state, spend, secret, old)
    except Unauthorized:
        await state.rates.failed_logins.count(address)
        raise
    return _start_session(state, cookie)


def _open_session(request: Request, state: AppState, spend: _Spend, secret: str, old: str | None) -> str:
    """Open a session, end the one that the browser had before, and return the cookie."""
    now_s = state.now_s()
    with state.database.writing() as session:
        cookie, caller = spend(session, secret, now_s=now_s, session_s=state.settings.session_s)
        if old is not None:
            keys.end_session(session, old, now_s=now_s)
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


def _redirect(state: AppState, **query: str) -> RedirectResponse:
    """Return a redirect to the page."""
    text = f"?{urlencode(query)}" if query else ""
    return RedirectResponse(f"{state.settings.path_prefix}/{text}", status_code=303)


def _cookie_path(state: AppState) -> str:
    return state.settings.path_prefix or "/"


def _start_session(state: AppState, cookie: str) -> Response:
    response = _redirect(state)
    response.set_cookie(
        COOKIE,
        cookie,
        max_age=int(state.settings.session_s),
        path=_cookie_path(state),
        httponly=True,
        samesite="strict",
        secure=state.settings.base_url.startswith("https://"),
    )
    return response
