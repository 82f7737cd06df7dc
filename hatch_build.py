"""The wheel holds the pages of the documentation besides the packages; `lippmann docs` shows them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

KEPT = {".md", ".svg", ".png", ".webp", ".gif"}


class Documentation(BuildHookInterface):  # type: ignore[type-arg]  # hatchling's configuration is of any type
    """Adds docs/ to a wheel. In an editable installation the pages are read from the source tree."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the files."""
        if version != "standard":
            return
        folder = Path(self.root) / "docs"
        for file in sorted(folder.rglob("*")):
            if file.suffix in KEPT:
                place = f"lippmann/documentation/pages/{file.relative_to(folder).as_posix()}"
                build_data["force_include"][str(file)] = place
