"""Reading the text of a scene.toml."""

from __future__ import annotations

import tomllib
from typing import Any


class ManifestError(ValueError):
    """The file scene.toml is not TOML."""


def read_manifest(data: bytes) -> dict[str, Any]:
    """Return the contents of a scene.toml.

    Raises
    ------
    ManifestError
        If the text is not TOML in UTF-8; the message names the place.
    """
    try:
        return tomllib.loads(data.decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ManifestError(f"scene.toml: expected TOML in UTF-8, got {error}") from error
