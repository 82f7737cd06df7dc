"""Make one figure by its name."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

from lippmann.experiments.machine import this_machine
from lippmann.experiments.request import CameraModel, FigureRequest, FigureResult
from lippmann.local.files.writable import check_writable
from lippmann.local.studies.plot import check_plots
from lippmann.terminal.progress import ProgressLine
from worker.engines.povray.version import check_povray
from worker.settings import WorkerSettings

FIGURES: Mapping[str, str] = MappingProxyType(
    {
        "fig3": "sample",
        "fig4": "sample",
        "fig5": "lens_image",
        "fig7": "sweep",
        "fig8": "growth",
        "fig9": "antialiasing",
        "fig10": "video",
        "fig11": "video",
    }
)
"""The module of each figure; the function that makes the figure has its name."""


@dataclass(frozen=True)
class Figure:
    """A figure and its file of numbers."""

    made: FigureResult
    numbers: Path
    data: Mapping[str, Any]
    """The content of the file of numbers."""


def run_figure(name: str, *, out: Path, quick: bool, camera: CameraModel = "orthographic") -> Figure:
    """Make a figure and write its numbers to `out`.

    Raises
    ------
    LippmannError
        If the folder cannot be written, POV-Ray or matplotlib is missing, or the rendering fails.
    """
    check_writable(out)
    check_plots()
    settings = WorkerSettings()
    check_povray(settings.povray)
    machine = this_machine(settings.povray)
    began_s = time.monotonic()
    with ProgressLine(name) as line:
        request = FigureRequest(name, out, quick, camera, settings, machine, lambda part, step: line.show(part, step))
        made: FigureResult = getattr(import_module(f"lippmann.experiments.figures.{FIGURES[name]}"), name)(request)
    data = {
        "figure": name,
        "quick": quick,
        "camera": camera,
        "machine": machine.data(),
        "seconds": round(time.monotonic() - began_s, 2),
        "files": [file.name for file in made.files],
        "settings": made.settings,
        "measured": made.measured,
    }
    numbers = out / f"{name}.json"
    numbers.write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    return Figure(made=made, numbers=numbers, data=data)
