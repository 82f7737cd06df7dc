"""Lippmann: a Python library, a command and a render farm for integral photography.

    from lippmann import IntegralImage, Client, design

IntegralImage   an integral image: open, views, refocus, depth, perspective, save
save_picture    a picture of linear light as PNG or TIFF
CellLayout      the lattice of lenses over its pixels, square or hexagonal
Eye             the place of an eye in front of a display
design          what a job will give: lens, views, display, depth budget, cost
JobSpec         a job, validated
Client          the HTTP client of a farm
LippmannError   the root of all errors

Names are imported when they are first used, so `import lippmann` is quick. The packages below it, from the bottom up:

errors        the errors
lattice       where the lenses are, square and hexagonal
job           what is asked for: job, rig, outputs, orders, events
optics        millimetres: lenses, rigs, drawings
lightfield    integral images in pixels: views, refocus, depth, observer, quality, calibration
plan          a job into tasks, tiles and artifact names; the designer; printing
terminal      progress and output on a terminal
documentation the pages of docs/ as HTML
client        the HTTP client
local         the work of a farm on this machine, without a farm
farm          a farm on this machine
experiments   the figures of the paper, made again
cli           the command `lippmann`
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lippmann.client import Client
    from lippmann.errors import LippmannError
    from lippmann.job.spec import JobSpec
    from lippmann.lattice.layout import CellLayout
    from lippmann.lightfield.views.perspective import Eye
    from lippmann.local.design import design
    from lippmann.local.files.image_files import save_picture
    from lippmann.local.image import IntegralImage

__all__ = ["CellLayout", "Client", "Eye", "IntegralImage", "JobSpec", "LippmannError", "design", "save_picture"]

_MODULES = {
    "CellLayout": "lippmann.lattice.layout",
    "Client": "lippmann.client",
    "Eye": "lippmann.lightfield.views.perspective",
    "IntegralImage": "lippmann.local.image",
    "JobSpec": "lippmann.job.spec",
    "LippmannError": "lippmann.errors",
    "design": "lippmann.local.design",
    "save_picture": "lippmann.local.files.image_files",
}


def __getattr__(name: str) -> Any:
    # A name is imported when it is first used: `import lippmann` and `lippmann --help` load no heavy library.
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_MODULES[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
