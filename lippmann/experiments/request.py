"""What a figure is asked for, and what it made."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lippmann.experiments.machine import Machine
from worker.settings import WorkerSettings

Tell = Callable[[float, str], None]
"""Told how far a figure is, 0 to 1, and what is being done."""


@dataclass(frozen=True)
class Request:
    """One figure, wanted."""

    name: str
    out: Path
    """A folder that can be written."""
    quick: bool
    """Small, in seconds: the shape of the thing and not the paper's settings."""
    settings: WorkerSettings
    machine: Machine
    tell: Tell

    def file(self, ending: str) -> Path:
        """Return where a file of this figure goes.

        `fig3.png` has the ending `.png`, `fig7a.png` the ending `a.png`.
        """
        return self.out / f"{self.name}{ending}"


@dataclass(frozen=True)
class Made:
    """What came out: the figure first, then the pictures at full size, movies and the like."""

    files: tuple[Path, ...]
    settings: Mapping[str, Any]
    """What it was made with."""
    measured: Mapping[str, Any]
    text: str
    """The measured numbers for people, a line each."""
