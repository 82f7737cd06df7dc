"""The text of a scene.toml, as data."""

from __future__ import annotations

import tomllib
from typing import Any


class ManifestError(ValueError):
    """scene.toml is not TOML."""


def read_manifest(data: bytes) -> dict[str, Any]:
    """Return what a scene.toml says.

    Raises
    ------
    ManifestError
        With the place where it stops being TOML.
    """
    try:
        return tomllib.loads(data.decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ManifestError(f"scene.toml: expected TOML in UTF-8, got {error}") from error
