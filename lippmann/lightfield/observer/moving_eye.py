"""The places of an eye that moves in front of a display, there and back, so that its clip can be looped."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from lippmann.errors import LayoutError
from lippmann.job.optics.viewing import EyePath
from lippmann.lightfield.views.perspective import Eye


def moving_eye(middle: Eye, *, path: EyePath, reach_mm: float, count: int, periods: int = 1) -> Iterator[Eye]:
    """Return the places of a moving eye at even times over whole periods.

    Parameters
    ----------
    middle
        Where it comes from: the middle of the path, and for `toward` its far end.
    path
        Which way it goes; see `EyePath`.
    reach_mm
        How far from there it gets.
    count
        Places in all.
    periods
        How often it goes there and back.

    Raises
    ------
    LayoutError
        If it would come to the display, or the reach is no number.
    """
    if not math.isfinite(reach_mm):
        raise LayoutError(f"expected a reach in mm, got {reach_mm:g}")
    if path == "toward" and reach_mm >= middle.distance_mm:
        raise LayoutError(
            f"expected an eye that comes nearer by less than its distance, {middle.distance_mm:g} mm, got {reach_mm:g}"
        )
    return (_place(middle, path, reach_mm, 2 * math.pi * periods * number / count) for number in range(count))


def _place(middle: Eye, path: EyePath, reach_mm: float, turn: float) -> Eye:
    if path == "still":
        return middle
    if path == "toward":
        return replace(middle, distance_mm=middle.distance_mm - reach_mm * (1 - math.cos(turn)) / 2)
    right = {"horizontal": math.sin(turn), "vertical": 0.0, "circle": math.cos(turn)}[path]
    up = 0.0 if path == "horizontal" else math.sin(turn)
    return replace(middle, x_mm=middle.x_mm + reach_mm * right, y_mm=middle.y_mm + reach_mm * up)
