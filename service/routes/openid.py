"""Login with an account of an OpenID provider. These routes exist only if `LIPPMANN_OIDC_ISSUER` is set."""

from __future__ import annotations

from typing import Annotated, cast

from fastapi import APIRouter, Header, Query, Request, Response
from fastapi.responses import RedirectResponse
from starlette.concurrency import run_in_threadpool

from service import browser_sessions
from service.audit import record
from service.dependencies import COOKIE, AppState, AppStateDep, with_origin
from service.errors import ProviderUnavailable, ServiceError
from service.oidc.account import Account, AccountRefused, LoginRefused, account_of
from service.oidc.handshake import LASTS_S, Handshake
from service.oidc.provider import Provider
from service.routes.login import counted, entered, redirect
from service.routes.middleware import address_of
from service.routes.problems import answer, wants_page
from service.schemas.access import AuditAction

router = APIRouter(tags=["access"])

PATH = "/login/oidc"
_REASONS: dict[type[ServiceError], str] = {
    LoginRefused: "login",
    AccountRefused: "account",
    ProviderUnavailable: "provider",
}
"""The value with which the login page is told of a failure."""
_Text = Annotated[str, Query(max_length=4096)]


@router.get(PATH, response_class=RedirectResponse, status_code=303)
async def begin_login(
    request: Request,
    state: AppStateDep,
    site: Annotated[str | None, Header(alias="Sec-Fetch-Site", include_in_schema=False)] = None,
) -> Response:
    """Send the browser to the provider, with a cookie that holds the secrets of this login.

    A link of another site leads to the login page instead, so that no site logs its visitors in.
    """
    if site in ("cross-site", "same-site"):
        return redirect(state)
    await state.rates.check_login(address_of(request))
    handshake = Handshake.new()
    try:
        url = await _provider(request).login_url(handshake)
    except (ProviderUnavailable, LoginRefused) as error:
        return await _refused(request, state, error)
    response = RedirectResponse(url, status_code=303, headers={"Cache-Control": "no-store"})
    # The provider leads back here from its own site, and strict cookies would stay away.
    response.set_cookie(
        _cookie_name(state), handshake.cookie, max_age=LASTS_S, path="/", httponly=True, samesite="lax",
        secure=_is_https(state),
    )  # fmt: skip
    return response


@router.get(f"{PATH}/callback", response_class=RedirectResponse, status_code=303)
async def complete_login(
    request: Request,
    state: AppStateDep,
    code: _Text = "",
    answered: Annotated[str, Query(alias="state", max_length=200)] = "",
    error: _Text = "",
    iss: _Text = "",
) -> Response:
    """Exchange the code of the provider for a browser session."""
    handshake = Handshake.from_cookie(request.cookies.get(_cookie_name(state)))
    try:
        async with counted(state, request):
            if handshake is None or not handshake.is_answered_by(answered):
                raise LoginRefused("this login was begun in another browser or has taken too long; log in again")
            if error or not code or iss not in ("", state.settings.oidc_issuer):
                raise LoginRefused("the provider has refused this login")
            claims = await _provider(request).claims(code, handshake)
            account = account_of(claims, state.settings)
        response = await run_in_threadpool(_log_in, request, state, account)
    except (LoginRefused, AccountRefused, ProviderUnavailable) as failure:
        response = await _refused(request, state, failure)
    response.delete_cookie(_cookie_name(state), path="/", secure=_is_https(state), httponly=True, samesite="lax")
    return response


def _log_in(request: Request, state: AppState, account: Account) -> Response:
    now_s, lasts_s = state.now_s(), min(state.settings.oidc_session_s, state.settings.session_s)
    old = request.cookies.get(COOKIE)
    with state.database.writing() as session:
        cookie, caller = browser_sessions.open_session(
            session, account.name, account.role, owner_id=account.owner_id, now_s=now_s, session_s=lasts_s
        )
        if old is not None:
            browser_sessions.end_session(session, old, now_s=now_s, lifetimes=state.lifetimes)
        caller = with_origin(request, caller)
        record(session, caller, AuditAction.LOG_IN, caller.id, now_s=now_s, detail=f"owner {account.owner_id}")
    # A page of the provider has led here, so the browser does not send the strict cookie yet; see the login page.
    return entered(state, cookie, max_age_s=lasts_s, entered="1")


async def _refused(request: Request, state: AppState, error: ServiceError) -> Response:
    """Lead a browser to the login page, which gives the reason; other clients get the error itself."""
    if wants_page(request):
        return redirect(state, refused=_REASONS[type(error)])
    return await answer(request, error)


def _provider(request: Request) -> Provider:
    return cast(Provider, request.app.state.openid)


def _is_https(state: AppState) -> bool:
    return state.settings.base_url.startswith("https://")


def _cookie_name(state: AppState) -> str:
    # With this prefix, no site under the same domain can set the cookie.
    return "__Host-lippmann_login" if _is_https(state) else "lippmann_login"
