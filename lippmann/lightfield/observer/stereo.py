"""Two eyes: their places, and their two pictures combined."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.job.optics.viewing import EYES_APART_MM, Stereo
from lippmann.lightfield.sheet.interpolation import Light, working
from lippmann.lightfield.views.perspective import Eye

_LEFT = np.array(
    [
        [0.4561, 0.500484, 0.176381],
        [-0.0400822, -0.0378246, -0.0157589],
        [-0.0152161, -0.0205971, -0.00546856],
    ]
)
_RIGHT = np.array(
    [
        [-0.0434706, -0.0879388, -0.00155529],
        [0.378476, 0.73364, -0.0184503],
        [-0.0721527, -0.112961, 1.2264],
    ]
)


def eye_pair(middle: Eye, *, apart_mm: float = EYES_APART_MM) -> tuple[Eye, Eye]:
    """Return the left and the right eye of a head.

    Parameters
    ----------
    middle
        The middle between the eyes.
    apart_mm
        The distance between the eyes, mm.

    Raises
    ------
    LayoutError
        If the distance is not positive.
    """
    if not 0 < apart_mm < math.inf:
        raise LayoutError(f"expected a positive distance between the eyes in mm, got {apart_mm:g}")
    return replace(middle, x_mm=middle.x_mm - apart_mm / 2), replace(middle, x_mm=middle.x_mm + apart_mm / 2)


def together(left: NDArray[Light], right: NDArray[Light], how: Stereo) -> NDArray[np.floating[Any]]:
    """Combine the pictures of two eyes into one.

    An anaglyph is the picture whose light through both filters of the glasses comes closest to what each eye should
    see, by least squares (E. Dubois, *A projection method to generate anaglyph stereo images*, Proc. IEEE ICASSP 2001;
    his matrices for red and cyan). Grey stays grey. It may go below 0 a little, where no screen can follow.

    Parameters
    ----------
    left, right
        `(row, col, 3)`, linear light, of one shape.
    how
        See `Stereo`.

    Raises
    ------
    LayoutError
        If the two are not of one shape, or for an anaglyph not of three channels.
    """
    if left.shape != right.shape or left.ndim != 3:
        raise LayoutError(f"expected two pictures (row, col, channel) of one shape, got {left.shape} and {right.shape}")
    if how == "side_by_side":
        return np.concatenate((left, right), axis=1)
    if how == "cross_eyed":
        return np.concatenate((right, left), axis=1)
    if left.shape[2] != 3:
        raise LayoutError(f"expected red, green and blue for an anaglyph, got {left.shape[2]} channels")
    light = working(left)
    mixed: NDArray[np.floating[Any]] = light @ _LEFT.T.astype(light.dtype)
    mixed += working(right) @ _RIGHT.T.astype(light.dtype)
    return mixed
