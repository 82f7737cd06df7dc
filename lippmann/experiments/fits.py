"""Straight lines through measured times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Line:
    """y = constant + slope x."""

    constant: float
    slope: float
    largest_deviation: float
    """Of the measured values from the line, as a part of the line."""

    def at(self, x: float) -> float:
        """Return the line's value."""
        return self.constant + self.slope * x

    def data(self) -> dict[str, Any]:
        """Return it for JSON."""
        return asdict(self)


def line_through(x: Sequence[float], y: Sequence[float]) -> Line:
    """Return the line nearest to points, by least squares of the relative deviations.

    Times are off by parts of themselves, so a long one must not outweigh the short ones.

    Parameters
    ----------
    x
        At least two different values.
    y
        Positive.

    >>> round(line_through([1, 2, 3], [5, 7, 9]).at(10), 9)
    23.0
    """
    xs, ys = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    # In units of the largest x, or pixels and seconds would be far apart.
    scale = float(np.abs(xs).max())
    slope, constant = np.polyfit(xs / scale, ys, 1, w=1 / ys)
    on_line = constant + slope * xs / scale
    deviation = float(np.abs(ys / on_line - 1).max())
    return Line(float(constant), float(slope / scale), deviation)
