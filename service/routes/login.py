"""Login and logout of browsers."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Cookie, Form, Query, Request, Response
from fastapi.responses import RedirectResponse

from service import auth as keys
from service.dependencies import COOKIE, AppState, AppStateDep, CallerOrNoneDep, ViewerDep
from service.errors import Unauthorized
from service.schemas.access import Session

router = APIRouter(tags=["access"])
api = APIRouter(tags=["access"])


@router.get("/login", response_class=RedirectResponse, status_code=303)
def log_in_by_link(state: AppStateDep, token: Annotated[str | None, Query(max_length=200)] = None) -> Response:
    """Exchange a login link for a browser session; without a token, redirect to the login page."""
    if token is None:
        return RedirectResponse("/", status_code=303)
    with state.database.writing() as session:
        cookie = keys.spend_login_token(session, token, now_s=state.now_s(), session_s=state.settings.session_s)
    return _start_session(state, cookie)


@router.post("/login", response_class=RedirectResponse, status_code=303)
def log_in_by_key(request: Request, state: AppStateDep, key: Annotated[str, Form(max_length=200)]) -> Response:
    """Exchange a key for a browser session; a page that sent an invalid key is redirected to `/?refused=1`."""
    try:
        with state.database.writing() as session:
            cookie = keys.spend_key(session, key.strip(), now_s=state.now_s(), session_s=state.settings.session_s)
    except Unauthorized:
        if "text/html" in request.headers.get("accept", ""):
            return RedirectResponse("/?refused=1", status_code=303)
        raise
    return _start_session(state, cookie)


@router.post("/logout", response_class=RedirectResponse, status_code=303)
def log_out(
    state: AppStateDep,
    _caller: CallerOrNoneDep,
    lippmann_session: Annotated[str | None, Cookie(include_in_schema=False)] = None,
) -> Response:
    """End a browser session."""
    if lippmann_session is not None:
        with state.database.writing() as session:
            keys.end_session(session, lippmann_session, now_s=state.now_s())
    response = RedirectResponse("/", status_code=303)
    response.delete_cookie(COOKIE, path="/")
    return response


@api.get("/session")
def get_caller(caller: ViewerDep) -> Session:
    """Get the name and the role of the caller."""
    return Session(name=caller.name, role=caller.role)


def _start_session(state: AppState, cookie: str) -> Response:
    response = RedirectResponse("/", status_code=303)
    response.set_cookie(
        COOKIE,
        cookie,
        max_age=int(state.settings.session_s),
        path="/",
        httponly=True,
        samesite="strict",
        secure=state.settings.base_url.startswith("https://"),
    )
    return response
