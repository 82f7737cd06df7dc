"""Viewing conditions: one eye or two, the pupil and the focus."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.optics.viewing import EYES_APART_MM, PUPIL_MM, RAYS, Stereo
from lippmann.lightfield.observer.display import LensDisplay
from lippmann.lightfield.observer.observe import observe, own_share
from lippmann.lightfield.observer.stereo import eye_pair, together
from lippmann.lightfield.observer.window import Window
from lippmann.lightfield.sheet.interpolation import Light
from lippmann.lightfield.views.perspective import Eye


@dataclass(frozen=True)
class ViewingConditions:
    """The viewing conditions of an observer, without the place; see `observe`."""

    pupil_mm: float = PUPIL_MM
    focus_mm: float = 0.0
    rays: int = RAYS
    stereo: Stereo | None = None
    """The arrangement of the pictures of two eyes; None for one eye."""
    eye_distance_mm: float = EYES_APART_MM

    def eyes(self, place: Eye) -> tuple[Eye, ...]:
        """Return one eye at a place, or the left and the right one beside it."""
        return (place,) if self.stereo is None else eye_pair(place, apart_mm=self.eye_distance_mm)


def observed_picture(
    sheet: NDArray[Light],
    display: LensDisplay,
    place: Eye,
    conditions: ViewingConditions,
    *,
    window: Window | None = None,
) -> NDArray[np.floating[Any]]:
    """Return the picture that an observer sees, with one eye or with two.

    Parameters
    ----------
    sheet, display, window
        See `observe`.
    place
        The position of the eye, or of the middle between two eyes.
    conditions
        The pupil, the focus and the arrangement of the eyes.

    Raises
    ------
    LayoutError
        See `observe`, `eye_pair` and `together`.
    """
    pictures = [
        observe(
            sheet,
            display,
            eye,
            pupil_mm=conditions.pupil_mm,
            focus_mm=conditions.focus_mm,
            rays=conditions.rays,
            window=window,
        )
        for eye in conditions.eyes(place)
    ]
    return pictures[0] if conditions.stereo is None else together(pictures[0], pictures[1], conditions.stereo)


def least_own_share(display: LensDisplay, place: Eye, conditions: ViewingConditions) -> float:
    """Return the share of lenses that show their own cell, to the eye of two that sees fewer of them.

    Parameters
    ----------
    display
        The display.
    place
        The place of the eye, or of the middle between two eyes.
    conditions
        One eye or two.
    """
    return min(own_share(display, eye) for eye in conditions.eyes(place))
