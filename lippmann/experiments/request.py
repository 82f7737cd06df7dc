"""The request for a figure, and its result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from lippmann.experiments.machine import Machine
from worker.settings import WorkerSettings

Report = Callable[[float, str], None]
"""Receives the progress of a figure, 0 to 1, and the current step."""

CameraModel = Literal["orthographic", "pinhole"]
"""The camera behind the array: telecentric, or the pinhole camera of the paper."""


@dataclass(frozen=True)
class FigureRequest:
    """A figure to make."""

    name: str
    out: Path
    """A folder that can be written."""
    quick: bool
    """True for a small version that takes seconds instead of the paper's settings."""
    camera: CameraModel
    settings: WorkerSettings
    machine: Machine
    report: Report

    def file(self, ending: str) -> Path:
        """Return the path of a file of this figure.

        The ending of `fig3.png` is `.png`, and that of `fig7a.png` is `a.png`.
        """
        return self.out / f"{self.name}{ending}"


@dataclass(frozen=True)
class FigureResult:
    """The files and numbers of a figure; the figure itself is the first file, before full-size pictures and movies."""

    files: tuple[Path, ...]
    settings: Mapping[str, Any]
    """The settings of the figure."""
    measured: Mapping[str, Any]
    text: str
    """The measured numbers as text, one line each."""
