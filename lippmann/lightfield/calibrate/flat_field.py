"""Flat-field correction: divide a picture by a picture of an evenly lit white surface through the same lenses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError

WHITE_PERCENT = 99.5
"""The percentile of a white image that counts as white: the middles of lenses in the middle of the picture."""

DARKEST = 0.05
"""The share of white below which, as between lenses, a picture is no further brightened."""


def divided_by_white(picture: NDArray[np.float32], white: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a picture without the vignetting of its lenses and of the objective in front of them.

    Every channel is divided by that of the white image, which is 1 where it is brightest. So the colour of the lamp
    does not change the picture, but a colour cast that changes over the picture is removed.

    Parameters
    ----------
    picture
        `(rows, cols, channel)`, linear light.
    white
        The white image, as large, linear light.

    Raises
    ------
    LayoutError
        If the white image has another size, or is black.

    Examples
    --------
    >>> picture = np.array([[[0.1], [0.4]]], dtype=np.float32)
    >>> divided_by_white(picture, 2 * picture).round(3)[..., 0]
    array([[0.398, 0.398]], dtype=float32)
    """
    if white.shape != picture.shape:
        raise LayoutError(f"expected a white image of {_size(picture)} as the picture, got {_size(white)}")
    brightest = np.percentile(white, WHITE_PERCENT, axis=(0, 1)).astype(np.float32)
    if not (brightest > 0).all():
        raise LayoutError("expected a white image, got one without light")
    divided: NDArray[np.float32] = picture / np.maximum(white / brightest, np.float32(DARKEST))
    return divided


def _size(picture: NDArray[Any]) -> str:
    return f"{picture.shape[1]} x {picture.shape[0]} px"
