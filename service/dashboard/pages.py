"""The two pages of the dashboard, and the static files that they load."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Header, Query
from fastapi.responses import HTMLResponse, Response
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from service.dashboard.assets import PREFIX, assets, import_map
from service.dashboard.policy import page_headers
from service.dependencies import AppStateDep, CallerOrNoneDep
from service.errors import NotFound

KEPT_FOR_A_YEAR = "public, max-age=31536000, immutable"
ASK_EVERY_TIME = "no-cache"

router = APIRouter(tags=["dashboard"])

_templates = Environment(
    loader=FileSystemLoader(Path(__file__).parent / "templates"), undefined=StrictUndefined, autoescape=True
)


@router.get("/", response_class=HTMLResponse)
def show_page(
    state: AppStateDep,
    caller: CallerOrNoneDep,
    refused: Annotated[str, Query(max_length=10)] = "",
    token: Annotated[str, Query(max_length=200)] = "",
) -> Response:
    """Return the dashboard to a logged-in user, and the login page to anyone else and to who follows a login link."""
    root = state.settings.path_prefix
    if caller is None or token:
        return _page("login.html", root, refused=bool(refused), token=token)
    return _dashboard_page(root)


@router.get(PREFIX + "{name:path}", response_class=Response)
def send_asset(
    name: str,
    v: Annotated[str, Query(description="The hash of the content.")] = "",
    if_none_match: Annotated[str | None, Header()] = None,
) -> Response:
    """Return a static file, cacheable for a year if the URL contains the hash of its content."""
    asset = assets().get(name)
    if asset is None:
        raise NotFound(f"there is no static file {name!r}")
    etag = f'"{asset.digest}"'
    headers = {
        "ETag": etag,
        "Cache-Control": KEPT_FOR_A_YEAR if v == asset.digest else ASK_EVERY_TIME,
        "X-Content-Type-Options": "nosniff",
    }
    if if_none_match is not None and etag in if_none_match:
        return Response(status_code=304, headers=headers)
    return Response(asset.body, media_type=asset.media_type, headers=headers)


def _dashboard_page(root: str) -> Response:
    # An escaped "<" cannot end the script element; the policy contains the hash of exactly this text.
    inline = json.dumps(import_map(root), separators=(",", ":")).replace("<", "\\u003c")
    modules = [name for name in assets() if name.endswith(".js") and name != "login.js"]
    return _page("index.html", root, inline, import_map=inline, modules=modules)


def _page(template: str, root: str, inline_script: str = "", **values: object) -> Response:
    def url(name: str) -> str:
        return root + assets()[name].url

    text = _templates.get_template(template).render(root=root, url=url, **values)
    return HTMLResponse(text, headers=page_headers(inline_script))
