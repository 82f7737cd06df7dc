"""Depth as colours for people: what is in front of the display warm, what is behind it cold, in its plane grey."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BEHIND = ((0.55, 0.55, 0.55), (0.10, 0.35, 0.75), (0.03, 0.10, 0.45))
IN_FRONT = ((0.55, 0.55, 0.55), (0.95, 0.45, 0.05), (0.60, 0.02, 0.02))
"""From the plane of the display to the farthest depth, linear light."""


def depth_colours(s_mm: NDArray[np.float32], *, deepest_mm: float) -> NDArray[np.float32]:
    """Return depths `(row, col)` as linear light `(row, col, 3)`; black where there is none.

    Parameters
    ----------
    s_mm
        Of the display, positive in front.
    deepest_mm
        What has the colour at the end, to either side; more has it too.
    """
    part = np.clip(np.abs(np.nan_to_num(s_mm)) / deepest_mm, 0, 1) * (len(BEHIND) - 1)
    steps = np.arange(len(BEHIND))
    sides = [
        np.stack([np.interp(part, steps, channel) for channel in zip(*colours, strict=True)], axis=-1)
        for colours in (BEHIND, IN_FRONT)
    ]
    light = np.where((s_mm > 0)[..., np.newaxis], sides[1], sides[0])
    return np.where(np.isnan(s_mm)[..., np.newaxis], 0, light).astype(np.float32)


def deepest_shown_mm(s_mm: NDArray[np.float32]) -> float:
    """Return the depth, to either side, that all but the last hundredth of the pixels stay within; 1 mm without any."""
    there = np.abs(s_mm[np.isfinite(s_mm)])
    return max(float(np.quantile(there, 0.99)), 1e-3) if there.size else 1.0
