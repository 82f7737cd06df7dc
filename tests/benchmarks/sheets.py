"""What integral images cost beside the optics: orders of pixels against a plain copy, and memory of sheets on disk."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.orthoscopic import half_turn_cells
from lippmann.lightfield.views.views import views_grid

ROUNDS = 15
"""Each is taken so often, in turn, after one that does not count; its least CPU time counts."""

LAYOUTS = {"square": CellLayout(100, 100, 24), "hexagonal": CellLayout(114, 100, 24, "hexagonal")}
"""2400 x 2400 px, and 2401 x 2412."""

_STREAMED = """
import sys
from pathlib import Path
import numpy as np
from worker.images.bands.rows import BAND_PX, open_rows
from worker.images.read import limit_threads
from worker.images.bands.rearrange import views_rows
from worker.images.write import write_exr_rows
from lippmann.lightfield.sheet.bands import OrthoscopicSheet, SheetOfRows, stitched
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.views import grid_size

side, folder = int(sys.argv[1]), Path(sys.argv[2])
limit_threads(1)
layout, noise = CellLayout(side // 20, side // 20, 20), np.random.default_rng(1)
sizes = {"captured": (side, side), "turned": (side, side), "upright": (side, side), "views": grid_size(layout)}

def write(name, bands):
    write_exr_rows(folder / f"{name}.exr", bands, size=sizes[name], attributes={})

def sheet(name):
    return SheetOfRows(opened[name], layout)

write("captured", (noise.random((20, side, 3), dtype=np.float32).astype(np.float16) for _ in range(side // 20)))
opened = {}
with open_rows(folder / "captured.exr", dtype=np.float16) as opened["captured"]:
    write("turned", stitched(OrthoscopicSheet(sheet("captured"), inverted=False), BAND_PX))
    write("upright", stitched(OrthoscopicSheet(sheet("captured"), inverted=True), BAND_PX))
with open_rows(folder / "upright.exr", dtype=np.float16) as opened["upright"]:
    write("views", views_rows(sheet("upright"), folder))
# The maximum of getrusage begins with that of the process which started this one.
(line,) = (line for line in open("/proc/self/status") if line.startswith("VmHWM"))
print(int(line.split()[1]) / 1024)
"""


def half_turn_ratio(folder: Path) -> str:
    """Return the half-turn of every cell of a sheet against one copy of it, 3 half floats a pixel."""
    return _against_a_copy(half_turn_cells)


def views_ratio(folder: Path) -> str:
    """Return all views of a sheet against one copy of it, 3 half floats a pixel."""
    return _against_a_copy(views_grid)


def streamed_mb(folder: Path) -> str:
    """Return the peak memory of turning 8000 x 8000 px in both ways and taking all views, from file to file."""
    return f"{peak_mb(8000, folder):.0f} MB"


def peak_mb(side: int, folder: Path) -> float:
    """Return the same of any size that divides by 20, px a side; takes 8 times the sheet on disk."""
    ran = subprocess.run(
        [sys.executable, "-c", _STREAMED, str(side), str(folder)], check=True, capture_output=True, text=True
    )
    return float(ran.stdout)


def _against_a_copy(made: Callable[[NDArray[np.float16], CellLayout], NDArray[np.float16]]) -> str:
    said = []
    for lattice, layout in LAYOUTS.items():
        sheet = np.random.default_rng(1).random((layout.rows, layout.cols, 3), dtype=np.float32).astype(np.float16)
        works: tuple[Callable[[], object], ...] = (sheet.copy, partial(made, sheet, layout))
        least_s = np.min([[_cpu_s(work) for work in works] for _ in range(ROUNDS + 1)][1:], axis=0)
        said.append(f"{least_s[1] / least_s[0]:.1f} {lattice}")
    return ", ".join(said)


def _cpu_s(work: Callable[[], object]) -> float:
    before_s = time.thread_time()
    work()
    return time.thread_time() - before_s
