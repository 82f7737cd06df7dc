"""One figure from its name."""

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
from lippmann.experiments.request import Made, Request
from lippmann.local.files.writable import check_writable
from lippmann.local.plot import check_plots
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
"""Figures and the module that makes each, by a function of its name."""


@dataclass(frozen=True)
class Figure:
    """A figure that was made."""

    made: Made
    numbers: Path
    data: Mapping[str, Any]
    """What the file of numbers says."""


def run_figure(name: str, *, out: Path, quick: bool) -> Figure:
    """Make a figure and write its numbers beside it.

    Raises
    ------
    LippmannError
        If the folder cannot be written, or POV-Ray or matplotlib is missing.
    lippmann.errors.LippmannError
        Whatever an attempt on the farm would fail with.
    """
    check_writable(out)
    check_plots()
    settings = WorkerSettings()
    check_povray(settings.povray)
    machine = this_machine(settings.povray)
    began_s = time.monotonic()
    with ProgressLine(name) as line:
        request = Request(name, out, quick, settings, machine, lambda part, words: line.show(part, words))
        made: Made = getattr(import_module(f"lippmann.experiments.figures.{FIGURES[name]}"), name)(request)
    data = {
        "figure": name,
        "quick": quick,
        "machine": machine.data(),
        "seconds": round(time.monotonic() - began_s, 2),
        "files": [file.name for file in made.files],
        "settings": made.settings,
        "measured": made.measured,
    }
    numbers = out / f"{name}.json"
    numbers.write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    return Figure(made=made, numbers=numbers, data=data)
