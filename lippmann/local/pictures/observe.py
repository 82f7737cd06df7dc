"""The view of an eye, two eyes or a moving eye of a display, written as PNG or MP4."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput
from lippmann.job.optics.viewing import EyePath
from lippmann.lightfield.observer.moving_eye import moving_eye
from lippmann.lightfield.observer.observe import whole_window
from lippmann.lightfield.observer.viewing_conditions import ViewingConditions, least_own_share, observed_picture
from lippmann.lightfield.observer.window import Window, window_of
from lippmann.lightfield.views.perspective import Eye
from lippmann.local.files.displayed_image import DisplayedImage
from lippmann.local.files.writable import check_writable
from lippmann.optics.rig.display import viewing_zone_mm
from lippmann.terminal.progress import ProgressLine
from worker.images.colour import srgb_codes
from worker.images.write import write_png
from worker.video.encode import Frame, encode
from worker.video.kinds import kind

MAX_CLIP_FRAMES = 10_000


@dataclass(frozen=True)
class Observer:
    """An observer: place, eyes, and the part of the display in the picture."""

    place: Eye
    """The place of the eye, or of the middle between two eyes."""
    conditions: ViewingConditions
    size_px: int
    """The longer side of the picture of one eye."""
    part_mm: tuple[float, float, float, float] | None = None
    """The part of the array in the picture: its middle (right, up), width and height; None for the whole array."""

    def window(self, image: DisplayedImage) -> Window:
        """Return the window of the picture on a display."""
        if self.part_mm is None:
            return whole_window(image.display, size_px=self.size_px)
        right, up, wide, high = self.part_mm
        return window_of(right_mm=right, up_mm=up, wide_mm=wide, high_mm=high, size_px=self.size_px)


@dataclass(frozen=True)
class Clip:
    """The path of a moving eye, once there and back."""

    path: EyePath
    reach_mm: float
    seconds: float
    fps: float

    @property
    def frames(self) -> int:
        """The number of frames."""
        count = self.seconds * self.fps if self.fps > 0 else math.nan
        if not 0.5 <= count <= MAX_CLIP_FRAMES:
            raise BadInput(
                f"expected a clip of 1 to {MAX_CLIP_FRAMES} frames, got {self.seconds:g} s of {self.fps:g} a second"
            )
        return max(1, round(count))


@dataclass(frozen=True)
class Observation:
    """The file of what an observer sees, and numbers of the display."""

    file: Path
    rows: int
    cols: int
    gap_mm: float
    """The reduced gap."""
    depths_times: float
    """The factor by which the gap stretches depths, g / f."""
    viewing_zone_mm: float
    """The width in which one lens shows its own cell, at the distance of the eye."""
    own_share: float
    """The share of the lenses that show their own cell, to the eye of two that sees fewer of them."""


def write_observation(image: DisplayedImage, out: Path, observer: Observer) -> Observation:
    """Write a PNG of what an observer sees.

    Parameters
    ----------
    image
        The display.
    out
        A PNG.
    observer
        The observer.

    Raises
    ------
    BadInput
        If the file cannot be written, or is no PNG.
    LayoutError
        If nothing can be seen in this way.
    """
    _check_suffix(out, ".png")
    picture = _picture(image, observer, observer.place)
    write_png(out, picture)
    return _observation(out, picture, image, observer)


def write_clip(image: DisplayedImage, out: Path, observer: Observer, clip: Clip) -> Observation:
    """Write an MP4 of what a moving observer sees.

    Parameters
    ----------
    image, observer
        As in `write_observation`.
    out
        An MP4.
    clip
        The path of the eye.

    Raises
    ------
    BadInput, LayoutError
        As in `write_observation`.
    """
    _check_suffix(out, ".mp4")
    count = clip.frames
    places = list(moving_eye(observer.place, path=clip.path, reach_mm=clip.reach_mm, count=count))
    first = _picture(image, observer, places[0])  # what cannot be seen is refused before there is a file

    def frames() -> Iterator[Frame]:
        yield srgb_codes(first)
        for number, place in enumerate(places[1:], start=2):
            line.show(number / count, f"frame {number} of {count}")
            yield srgb_codes(_picture(image, observer, place))

    with ProgressLine("clip") as line:
        encode(out, frames(), kind=kind("h264"), fps=clip.fps)
    return _observation(out, first, image, observer)


def _picture(image: DisplayedImage, observer: Observer, place: Eye) -> NDArray[np.floating[Any]]:
    return observed_picture(image.pixels, image.display, place, observer.conditions, window=observer.window(image))


def _check_suffix(out: Path, suffix: str) -> None:
    if out.suffix.lower() != suffix:
        raise BadInput(f"expected a {suffix} in --out, got {out}")
    check_writable(out.parent)


def _observation(
    out: Path, picture: NDArray[np.floating[Any]], image: DisplayedImage, observer: Observer
) -> Observation:
    display, place = image.display, observer.place
    return Observation(
        file=out,
        rows=picture.shape[0],
        cols=picture.shape[1],
        gap_mm=display.gap_mm,
        depths_times=display.gap_mm / display.focal_mm,
        viewing_zone_mm=viewing_zone_mm(
            pitch_mm=display.pitch_mm, gap_mm=display.gap_mm, distance_mm=place.distance_mm
        ),
        own_share=least_own_share(display, place, observer.conditions),
    )
