"""Displays for the tests of the observer, and pictures measured in millimetres."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.observer.display import LensDisplay
from lippmann.lightfield.observer.window import Window

F_MM = 3.3
GAP_REAL_MM = 1.5 + 3.3 / 1.49
GAP_VIRTUAL_MM = 3.3 / 1.49


def display_of(layout: CellLayout, **more: Any) -> LensDisplay:
    """Return a display of lenses of 1 mm that send parallel light, unless `more` says otherwise."""
    return LensDisplay(**{"layout": layout, "pitch_mm": 1.0, "focal_mm": F_MM, "gap_mm": F_MM, **more})


def centroid_mm(picture: NDArray[Any], window: Window) -> tuple[float, float]:
    """Return the middle of the light of a picture, mm from the display's, (right, up)."""
    light = picture.sum(axis=2, dtype=float)
    x, y = (light.sum(axis=0) * window.across_mm).sum(), -(light.sum(axis=1) * window.down_mm).sum()
    return x / light.sum(), y / light.sum()
