"""The way of an eye that moves before a display: round and round, so that a clip of it can be looped."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

from worker.errors import LayoutError
from worker.integral.perspective import Eye

EyeWay = Literal["swing", "circle", "toward"]
"""`swing`: to the right, to the left and back; `circle`: round the middle, from the right upward; `toward`: nearer and
back."""

REACH_MM = 30.0
"""To the side: inside the viewing zone of every lens of the paper's array from 500 mm."""


def eye_path(middle: Eye, *, way: EyeWay, reach_mm: float, count: int, rounds: int = 1) -> Iterator[Eye]:
    """Return the places of an eye, evenly in time, over whole rounds.

    Parameters
    ----------
    middle
        Where it comes from: the middle of the way, and for `toward` its far end.
    way
        Which way it goes.
    reach_mm
        How far from there it gets.
    count
        Places in all.
    rounds
        How often round.

    Raises
    ------
    LayoutError
        If it would come to the display, or the reach is no number.
    """
    if not math.isfinite(reach_mm):
        raise LayoutError(f"expected a reach in mm, got {reach_mm:g}")
    if way == "toward" and reach_mm >= middle.distance_mm:
        raise LayoutError(
            f"expected an eye that comes nearer by less than its distance, {middle.distance_mm:g} mm, got {reach_mm:g}"
        )
    return (_place(middle, way, reach_mm, 2 * math.pi * rounds * number / count) for number in range(count))


def _place(middle: Eye, way: EyeWay, reach_mm: float, turn: float) -> Eye:
    if way == "toward":
        return replace(middle, distance_mm=middle.distance_mm - reach_mm * (1 - math.cos(turn)) / 2)
    right, up = (math.sin(turn), 0.0) if way == "swing" else (math.cos(turn), math.sin(turn))
    return replace(middle, x_mm=middle.x_mm + reach_mm * right, y_mm=middle.y_mm + reach_mm * up)
