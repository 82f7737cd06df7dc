"""Luminance of linear light, with the weights of ITU-R BT.709-6, item 3.2."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

WEIGHTS = np.array([0.2126, 0.7152, 0.0722])
"""The luminance of red, green and blue (ITU-R BT.709-6, item 3.2)."""


def luminance(picture: NDArray[Any]) -> NDArray[np.float64]:
    """Compute the luminance `(rows, cols)` of a picture `(rows, cols, channel)`; else the mean of the channels.

    >>> luminance(np.array([[[1.0, 1.0, 0.0]]])).round(4)
    array([[0.9278]])
    """
    light = picture.astype(np.float64, copy=False)
    bright: NDArray[np.float64] = light @ WEIGHTS if picture.shape[2] == len(WEIGHTS) else light.mean(axis=2)
    return bright
