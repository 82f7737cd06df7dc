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
    """The largest relative deviation of a measured value from the line."""

    def at(self, x: float) -> float:
        """Return the value of the line at `x`."""
        return self.constant + self.slope * x

    def data(self) -> dict[str, Any]:
        """Return the line as data for JSON."""
        return asdict(self)


def line_through(x: Sequence[float], y: Sequence[float]) -> Line:
    """Fit a line to points by least squares of the relative deviations.

    The errors of measured times are relative, so that a long time must not outweigh the short ones.

    Parameters
    ----------
    x
        The abscissas, at least two different values.
    y
        The ordinates, positive.

    >>> round(line_through([1, 2, 3], [5, 7, 9]).at(10), 9)
    23.0
    """
    xs, ys = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    # The fit is scaled by the largest x, because pixels and seconds differ by orders of magnitude.
    scale = float(np.abs(xs).max())
    slope, constant = np.polyfit(xs / scale, ys, 1, w=1 / ys)
    on_line = constant + slope * xs / scale
    deviation = float(np.abs(ys / on_line - 1).max())
    return Line(float(constant), float(slope / scale), deviation)
