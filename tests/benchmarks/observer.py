"""The observer: how long its pictures take, and how many rays they need."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.observer.display import LensDisplay
from lippmann.lightfield.observer.observe import observe
from lippmann.lightfield.views.perspective import Eye
from tests.unit.lippmann.lightfield.textures import sheet_of_texture
from worker.images.colour import srgb_codes

REPEATS = 5


def one_ray_ms(folder: Path) -> str:
    """Return the time of a picture by one ray a pixel."""
    return _ms(rays=1)


def pupil_ms(folder: Path) -> str:
    """Return the time of a picture by 64 rays through the pupil of every pixel."""
    return _ms(rays=64)


def rays_differ(folder: Path) -> str:
    """Return the RMS difference of pictures by 1, 4, 16, 64 and 256 rays from one by 4096, in 8-bit codes."""
    layout = CellLayout(90, 90, 8)
    ripples = sheet_of_texture(layout, lambda x, y: 0.5 + 0.4 * np.sin(x) * np.cos(1.3 * y), 20.0, focal_mm=3.3)
    sheet = np.repeat(ripples, 3, axis=2)
    display = LensDisplay(layout=layout, pitch_mm=1.0, focal_mm=3.3, gap_mm=3.3)
    codes = {
        rays: srgb_codes(observe(sheet, display, Eye(13.1, 7.7, 500.0), rays=rays)).astype(float)
        for rays in (1, 4, 16, 64, 256, 4096)
    }
    return " ".join(f"{np.sqrt(np.mean((codes[rays] - codes[4096]) ** 2)):.1f}" for rays in (1, 4, 16, 64, 256))


def _ms(*, rays: int) -> str:
    layout = CellLayout(90, 90, 8)
    sheet = np.random.default_rng(1).random((720, 720, 3)).astype(np.float16)
    display = LensDisplay(layout=layout, pitch_mm=1.0, focal_mm=3.3, gap_mm=3.3)
    times_s = []
    for number in range(REPEATS):
        began_s = time.perf_counter()
        observe(sheet, display, Eye(10.0 * number, 5.0, 500.0), rays=rays)
        times_s.append(time.perf_counter() - began_s)
    return f"{min(times_s) * 1000:.0f} ms"
