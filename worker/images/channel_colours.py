"""The colours in which people are shown channels that are no light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.job.rendering.render_settings import Channel
from worker.images.colour import decoded_srgb

GOLDEN_RATIO = (5**0.5 - 1) / 2
"""The step of the hue from one object to the next: neighbours differ, and no two of a few hundred are alike."""


def channel_colours(channel: Channel, values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the numbers of a channel as linear light `(row, col, 3)`; black without a surface.

    The sRGB codes of a normal are 255 (n + 1) / 2 in red, green and blue, as in a normal map; and so are those of a
    motion, divided by the 99th percentile of the greatest of its three numbers. Every object has a hue.

    Parameters
    ----------
    channel
        The channel.
    values
        `(row, col, number)`; see `lippmann.job.rendering.channels`.
    """
    if channel == "normal":
        light = decoded_srgb(np.clip((values.astype(np.float64) + 1) / 2, 0, 1))
    elif channel == "object":
        light = _object_colours(values[..., 0])
    elif channel == "motion":
        light = decoded_srgb(np.clip((values.astype(np.float64) / _longest(values) + 1) / 2, 0, 1))
    else:
        light = values.astype(np.float64)
    return np.nan_to_num(light, nan=0.0).astype(np.float32)


def _longest(motion: NDArray[np.float32]) -> float:
    there = np.abs(motion[np.isfinite(motion).all(axis=-1)]).max(axis=-1, initial=0.0)
    return max(float(np.quantile(there, 0.99)), 1e-9) if there.size else 1.0


def _object_colours(numbers: NDArray[np.float32]) -> NDArray[np.float64]:
    hue = (numbers.astype(np.float64) * GOLDEN_RATIO % 1.0)[..., np.newaxis] * 6
    # The six edges of the cube of colours; see A. R. Smith, Color gamut transform pairs, SIGGRAPH 1978.
    ramps = np.clip(np.abs((hue + np.array([0.0, 4.0, 2.0])) % 6 - 3) - 1, 0, 1)
    light: NDArray[np.float64] = np.where(numbers[..., np.newaxis] > 0, decoded_srgb(0.25 + 0.7 * ramps), 0.0)
    return light
