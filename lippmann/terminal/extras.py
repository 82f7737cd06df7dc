"""The command that installs an optional package."""

from __future__ import annotations

import sys
from pathlib import Path


def how_to_install(extra: str) -> str:
    """Return the command that installs an extra of Lippmann in the environment in which it runs.

    >>> how_to_install("plots").endswith("install 'lippmann[plots]'")
    True
    """
    is_pipx = (Path(sys.prefix) / "pipx_metadata.json").is_file()
    return f"{'pipx runpip lippmann' if is_pipx else 'pip'} install 'lippmann[{extra}]'"
