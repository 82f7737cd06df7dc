"""Browsers come in and go out."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Cookie, Form, Query, Request, Response
from fastapi.responses import RedirectResponse

from service import auth as keys
from service.dependencies import COOKIE, CallerOrNoneDep, House, HouseDep, ViewerDep
from service.errors import Unauthorized
from service.schemas.access import Session

router = APIRouter(tags=["access"])
api = APIRouter(tags=["access"])


@router.get("/login", response_class=RedirectResponse, status_code=303)
def log_in_by_link(house: HouseDep, token: Annotated[str | None, Query(max_length=200)] = None) -> Response:
    """Exchange a login link for a browser session; without a token, go where a key is asked for."""
    if token is None:
        return RedirectResponse("/", status_code=303)
    with house.database.writing() as session:
        cookie = keys.spend_login_token(session, token, now_s=house.now_s(), session_s=house.settings.session_s)
    return _let_in(house, cookie)


@router.post("/login", response_class=RedirectResponse, status_code=303)
def log_in_by_key(request: Request, house: HouseDep, key: Annotated[str, Form(max_length=200)]) -> Response:
    """Exchange a key for a browser session; a page that sent a wrong one comes back with `?refused=1`."""
    try:
        with house.database.writing() as session:
            cookie = keys.spend_key(session, key.strip(), now_s=house.now_s(), session_s=house.settings.session_s)
    except Unauthorized:
        if "text/html" in request.headers.get("accept", ""):
            return RedirectResponse("/?refused=1", status_code=303)
        raise
    return _let_in(house, cookie)


@router.post("/logout", response_class=RedirectResponse, status_code=303)
def log_out(
    house: HouseDep,
    _caller: CallerOrNoneDep,
    lippmann_session: Annotated[str | None, Cookie(include_in_schema=False)] = None,
) -> Response:
    """End a browser session."""
    if lippmann_session is not None:
        with house.database.writing() as session:
            keys.end_session(session, lippmann_session, now_s=house.now_s())
    response = RedirectResponse("/", status_code=303)
    response.delete_cookie(COOKIE, path="/")
    return response


@api.get("/session")
def show_session(caller: ViewerDep) -> Session:
    """Say who is calling."""
    return Session(name=caller.name, role=caller.role)


def _let_in(house: House, cookie: str) -> Response:
    response = RedirectResponse("/", status_code=303)
    response.set_cookie(
        COOKIE,
        cookie,
        max_age=int(house.settings.session_s),
        path="/",
        httponly=True,
        samesite="strict",
        secure=house.settings.base_url.startswith("https://"),
    )
    return response
