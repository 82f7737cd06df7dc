"""Static files. Their URLs contain a hash of the content, so that browsers may cache them for a year.

The page loads its own modules and its style sheets as one file each; the import map leads to the packages of others.
"""

from __future__ import annotations

import gzip
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

from service.dashboard.bundle import bundled_modules, joined_sheets

FOLDER = Path(__file__).parent / "static"
PREFIX = "/static/"

MEDIA_TYPES = MappingProxyType(
    {
        ".js": "text/javascript; charset=utf-8",
        ".css": "text/css; charset=utf-8",
        ".svg": "image/svg+xml",
    }
)
"""The media types of the files that are served. Other files of the folder (licences, hashes) are not."""

VENDORED = MappingProxyType(
    {
        "preact": "vendor/preact.js",
        "preact/hooks": "vendor/preact-hooks.js",
        "htm": "vendor/htm.js",
        "uplot": "vendor/uplot.js",
    }
)
"""The bare names that modules import, and their files."""

ON_DEMAND = frozenset({"uplot"})
"""The packages that a page imports when it needs them, and none preloads."""

START = "app.js"
"""The module that starts the page."""

SHEETS = (
    "shared/base.css",
    "shared/marks.css",
    "shared/layout.css",
    "jobs/list.css",
    "jobs/job.css",
    "jobs/frames.css",
    "jobs/work.css",
    "jobs/timeline.css",
    "jobs/compare.css",
    "new-job/submit.css",
    "new-job/keyframes.css",
    "new-job/inputs.css",
    "new-job/send.css",
    "new-job/design.css",
    "viewer/viewer.css",
    "viewer/stage.css",
    "viewer/controls.css",
    "viewer/film_strip.css",
    "account/keys.css",
    "account/account.css",
    "farm/farm.css",
)
"""The style sheets of the page, in their order."""

MODULES_OF_PAGE, SHEET_OF_PAGE = "page.js", "page.css"
"""The files that are made of the modules and of the sheets of the page."""


@dataclass(frozen=True)
class Asset:
    """One static file."""

    name: str
    media_type: str
    body: bytes
    digest: str
    packed: bytes
    """The body as gzip."""

    @property
    def url(self) -> str:
        """The URL that a browser may cache."""
        return f"{PREFIX}{self.name}?v={self.digest}"


@cache
def assets() -> Mapping[str, Asset]:
    """Return all static files by name; they are read once."""
    files = sorted(path for path in FOLDER.rglob("*") if path.suffix in MEDIA_TYPES)
    found = {path.relative_to(FOLDER).as_posix(): path.read_bytes() for path in files}
    modules = {name: body.decode() for name, body in found.items() if name.endswith(".js")}
    found[MODULES_OF_PAGE] = bundled_modules(START, modules).encode()
    found[SHEET_OF_PAGE] = joined_sheets(found[name].decode() for name in SHEETS).encode()
    return MappingProxyType({name: _asset(name, body) for name, body in found.items()})


def import_map(root: str = "") -> dict[str, dict[str, str]]:
    """Return the import map, from the names of packages to URLs with hashes.

    Parameters
    ----------
    root
        The path under which a reverse proxy serves the dashboard.
    """
    found = assets()
    return {"imports": {bare: root + found[name].url for bare, name in VENDORED.items()}}


def _asset(name: str, body: bytes) -> Asset:
    return Asset(
        name=name,
        media_type=MEDIA_TYPES[Path(name).suffix],
        body=body,
        digest=hashlib.sha256(body).hexdigest()[:16],
        packed=gzip.compress(body, mtime=0),
    )
