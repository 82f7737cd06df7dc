"""Static files. Their URLs contain a hash of the content, so that browsers may cache them for a year.

Modules import each other by plain relative names; the import map of the page maps each name to its URL with the hash.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

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
    {"preact": "vendor/preact.js", "preact/hooks": "vendor/preact-hooks.js", "htm": "vendor/htm.js"}
)
"""The bare names that modules import, and their files."""


@dataclass(frozen=True)
class Asset:
    """One static file."""

    name: str
    media_type: str
    body: bytes
    digest: str

    @property
    def url(self) -> str:
        """The URL that a browser may cache."""
        return f"{PREFIX}{self.name}?v={self.digest}"


@cache
def assets() -> Mapping[str, Asset]:
    """Return all static files by name; they are read once."""
    files = sorted(path for path in FOLDER.rglob("*") if path.suffix in MEDIA_TYPES)
    return MappingProxyType({asset.name: asset for asset in map(_read, files)})


def import_map(root: str = "") -> dict[str, dict[str, str]]:
    """Return the import map, from bare names and plain URLs of modules to URLs with hashes.

    Parameters
    ----------
    root
        The path under which a reverse proxy serves the dashboard.
    """
    found = assets()
    plain = {root + PREFIX + name: root + asset.url for name, asset in found.items() if name.endswith(".js")}
    return {"imports": {bare: root + found[name].url for bare, name in VENDORED.items()} | plain}


def _read(path: Path) -> Asset:
    body = path.read_bytes()
    return Asset(
        name=path.relative_to(FOLDER).as_posix(),
        media_type=MEDIA_TYPES[path.suffix],
        body=body,
        digest=hashlib.sha256(body).hexdigest()[:16],
    )
