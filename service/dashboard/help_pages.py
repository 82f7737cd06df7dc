"""The documentation of the installed version as pages of the service; `lippmann docs` writes the same pages as files.

A caller needs a key, as for the page of the API: before the login the service answers only what the login needs.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType

from fastapi import APIRouter
from fastapi.responses import FileResponse, HTMLResponse, RedirectResponse, Response

from lippmann.documentation.pages import INDEX, Page, docs_folder, list_pages
from lippmann.documentation.site import page_html, site_files
from lippmann.errors import BadInput
from service.dashboard.assets import assets
from service.dashboard.policy import page_headers
from service.dependencies import AppStateDep, ViewerDep
from service.errors import NotFound

MEDIA_TYPES = MappingProxyType(
    {
        ".css": "text/css; charset=utf-8",
        ".gif": "image/gif",
        ".png": "image/png",
        ".svg": "image/svg+xml",
        ".webp": "image/webp",
    }
)

router = APIRouter(tags=["dashboard"])


@router.get("/help/{name:path}", response_class=HTMLResponse)
def show_help(name: str, state: AppStateDep, _caller: ViewerDep) -> Response:
    """Return a page of the documentation such as `printing.html`, one of its pictures, or the way to the first page."""
    if not name:
        return RedirectResponse(f"{INDEX}.html")
    pages, files = _site()
    headers = page_headers("")
    if name.endswith(".html") and (page := pages.get(name.removesuffix(".html"))):
        return HTMLResponse(_text_of(page, state.settings.path_prefix), headers=headers)
    if file := files.get(name):
        headers["Cache-Control"] = "private, max-age=3600"
        return FileResponse(file, media_type=MEDIA_TYPES[file.suffix], headers=headers)
    raise NotFound(f"there is no page {name!r} in the documentation")


@cache
def _site() -> tuple[Mapping[str, Page], Mapping[str, Path]]:
    """Return the pages and the other files of the documentation, by name."""
    try:
        source = docs_folder()
    except BadInput as error:
        raise NotFound(error.message) from error
    return {page.name: page for page in list_pages(source)}, site_files(source)


@cache
def _text_of(page: Page, root: str) -> str:
    return page_html(page, _site()[0].keys(), home=f"{root}/", icon=root + assets()["logo.svg"].url)
