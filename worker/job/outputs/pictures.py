"""Still pictures of every frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from worker.job.outputs.output import Name, OutputOptions


class ViewGrid(OutputOptions):
    """All views side by side: v down, u across."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {".png": {}}

    kind: Literal["view_grid"] = "view_grid"
    name: Name = "view_grid"
    bits: Literal[8, 16] = 8

    @property
    def suffix(self) -> str:
        """PNG."""
        return ".png"
