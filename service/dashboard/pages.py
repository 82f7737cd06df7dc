"""The pages of the dashboard, and the static files that they load."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import MappingProxyType
from typing import Annotated

from fastapi import APIRouter, Header, Query, Request
from fastapi.responses import HTMLResponse, Response
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from service.auth import Caller
from service.dashboard.api_reference import reference_of
from service.dashboard.assets import MODULES_OF_PAGE, ON_DEMAND, PREFIX, SHEET_OF_PAGE, VENDORED, assets, import_map
from service.dashboard.policy import page_headers
from service.dependencies import AppStateDep, CallerOrNoneDep, ViewerDep
from service.errors import NotFound
from service.schemas.access import Session
from service.schemas.problem import Problem

KEPT_FOR_A_YEAR = "public, max-age=31536000, immutable"
ASK_EVERY_TIME = "no-cache"

REASONS = MappingProxyType(
    {
        "1": "This key is unknown, or the link was used or has expired.",
        "ended": "Your session has ended, or its key was revoked. Log in again, and you are back where you were.",
        "login": "The login with your account has failed. Log in again.",
        "account": "Your account has no access to this farm. Its administrator can change that.",
        "provider": "The login of your organisation does not answer. Try again later.",
    }
)
"""Why a login was refused, by the value of `refused`."""

router = APIRouter(tags=["dashboard"])

_templates = Environment(
    loader=FileSystemLoader(Path(__file__).parent / "templates"),
    undefined=StrictUndefined,
    autoescape=True,
    trim_blocks=True,
    lstrip_blocks=True,
)


@router.get("/", response_class=HTMLResponse)
def show_page(
    state: AppStateDep,
    caller: CallerOrNoneDep,
    refused: Annotated[str, Query(max_length=10)] = "",
    token: Annotated[str, Query(max_length=200)] = "",
    entered: Annotated[str, Query(max_length=10)] = "",
) -> Response:
    """Return the dashboard to a logged-in user, and the login page to anyone else and to who follows a login link.

    A browser that comes from a provider has a cookie that it does not send before a page of ours leads it on.
    """
    settings = state.settings
    root = settings.path_prefix
    if caller is not None and not token:
        state.processes.warm_up()  # The page shows pictures next.
        return _dashboard_page(root, caller, panel_url=settings.panel_url)
    provider = settings.oidc_name if settings.oidc_issuer else ""
    reason = REASONS.get(refused, REASONS["1"]) if refused else ""
    return _page("login.html", root, reason=reason, token=token, entered=bool(entered), provider=provider)


@router.get("/docs", response_class=HTMLResponse)
def show_api(request: Request, state: AppStateDep, _caller: ViewerDep) -> Response:
    """Return the page of the API: every operation and every shape of openapi.json, without a script."""
    return _page("api.html", state.settings.path_prefix, reference=reference_of(request.app.openapi()))


def problem_page(root: str, problem: Problem) -> Response:
    """Return the page that shows a problem to the user of a browser.

    Parameters
    ----------
    root
        The path under which a reverse proxy serves the dashboard.
    """
    response = _page("problem.html", root, problem=problem)
    response.status_code = problem.status
    return response


@router.get(PREFIX + "{name:path}", response_class=Response)
def send_asset(
    name: str,
    v: Annotated[str, Query(description="The hash of the content.")] = "",
    if_none_match: Annotated[str | None, Header()] = None,
    accept_encoding: Annotated[str, Header()] = "",
) -> Response:
    """Return a static file, cacheable for a year if the URL contains the hash of its content."""
    asset = assets().get(name)
    if asset is None:
        raise NotFound(f"there is no static file {name!r}")
    etag = f'"{asset.digest}"'
    headers = {
        "ETag": etag,
        "Cache-Control": KEPT_FOR_A_YEAR if v == asset.digest else ASK_EVERY_TIME,
        "Vary": "Accept-Encoding",
        "X-Content-Type-Options": "nosniff",
    }
    if if_none_match is not None and etag in if_none_match:
        return Response(status_code=304, headers=headers)
    if re.search(r"\bgzip\b(?!\s*;\s*q=0(?:\.0*)?(?:,|$))", accept_encoding):
        return Response(asset.packed, media_type=asset.media_type, headers={**headers, "Content-Encoding": "gzip"})
    return Response(asset.body, media_type=asset.media_type, headers=headers)


def _dashboard_page(root: str, caller: Caller, *, panel_url: str) -> Response:
    # An escaped "<" cannot end the script element; the policy contains the hash of exactly this text.
    inline = json.dumps(import_map(root), separators=(",", ":")).replace("<", "\\u003c")
    return _page(
        "index.html",
        root,
        inline,
        panel_url=panel_url,
        import_map=inline,
        script=MODULES_OF_PAGE,
        sheet=SHEET_OF_PAGE,
        session=Session(name=caller.name, role=caller.role, owner_id=caller.owner_id).model_dump_json(),
        packages=(name for package, name in VENDORED.items() if package not in ON_DEMAND),
    )


def _page(template: str, root: str, inline_script: str = "", *, panel_url: str = "", **values: object) -> Response:
    def url(name: str) -> str:
        return root + assets()[name].url

    text = _templates.get_template(template).render(root=root, url=url, panel=panel_url, **values)
    return HTMLResponse(text, headers=page_headers(inline_script, panel_url=panel_url))
