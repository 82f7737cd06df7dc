"""What an eye, two eyes or a moving eye sees of a display, as PNG or MP4."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput, LayoutError
from lippmann.job.viewing import EyePath
from lippmann.lightfield.observer.looking import Looking, least_own_share, look
from lippmann.lightfield.observer.moving_eye import moving_eye
from lippmann.lightfield.observer.observe import whole_window
from lippmann.lightfield.observer.window import Window, window_of
from lippmann.lightfield.views.perspective import Eye
from lippmann.local.display import Shown
from lippmann.local.files.writable import check_writable
from lippmann.local.numbers import numbers_of
from lippmann.optics.rig.display import viewing_zone_mm
from lippmann.terminal.progress import ProgressLine
from worker.images.colour import srgb_codes
from worker.images.write import write_png
from worker.video.encode import Frame, encode
from worker.video.kinds import kind

MAX_CLIP_FRAMES = 10_000


@dataclass(frozen=True)
class Observer:
    """Who looks, from where, at which part."""

    place: Eye
    """Of the eye, or of the middle between two."""
    looking: Looking
    size_px: int
    """Longer side of an eye's picture."""
    part_mm: tuple[float, float, float, float] | None = None
    """Of the array: the middle of the part (right, up), its width and height; all of it when not said."""

    def window(self, shown: Shown) -> Window:
        """Return what the picture shows."""
        if self.part_mm is None:
            return whole_window(shown.display, size_px=self.size_px)
        right, up, wide, high = self.part_mm
        return window_of(right_mm=right, up_mm=up, wide_mm=wide, high_mm=high, size_px=self.size_px)


@dataclass(frozen=True)
class Clip:
    """How the eye moves, once round."""

    path: EyePath
    reach_mm: float
    seconds: float
    fps: float

    @property
    def frames(self) -> int:
        """How many there are."""
        counts = self.seconds * self.fps if self.fps > 0 else math.nan
        if not 0.5 <= counts <= MAX_CLIP_FRAMES:
            raise BadInput(
                f"expected a clip of 1 to {MAX_CLIP_FRAMES} frames, got {self.seconds:g} s of {self.fps:g} a second"
            )
        return max(1, round(counts))


@dataclass(frozen=True)
class Observed:
    """What was seen."""

    file: Path
    rows: int
    cols: int
    gap_mm: float
    """Reduced."""
    depths_times: float
    """By how much the gap stretches depths: g / f."""
    viewing_zone_mm: float
    """Width in which one lens shows its own cell, at the eye's distance."""
    own_share: float
    """Of the lenses that show their own cell from the place, to the eye of two that sees fewer of them."""


def observe_here(shown: Shown, out: Path, observer: Observer) -> Observed:
    """Write a PNG of what is seen.

    Raises
    ------
    BadInput
        If nothing can be seen so, or the file cannot be written.
    """
    _check_suffix(out, ".png")
    picture = _seen(shown, observer, observer.place)
    write_png(out, picture)
    return _observed(out, picture, shown, observer)


def clip_here(shown: Shown, out: Path, observer: Observer, clip: Clip) -> Observed:
    """Write an MP4 of what a moving observer sees.

    Raises
    ------
    BadInput
        If nothing can be seen so, or the file cannot be written.
    """
    _check_suffix(out, ".mp4")
    count = clip.frames
    try:
        places = list(moving_eye(observer.place, path=clip.path, reach_mm=clip.reach_mm, count=count))
    except LayoutError as error:
        raise BadInput(error.message) from error
    first = _seen(shown, observer, places[0])  # what cannot be is said before there is a file

    def frames() -> Iterator[Frame]:
        yield srgb_codes(first)
        for number, place in enumerate(places[1:], start=2):
            line.show(number / count, f"frame {number} of {count}")
            yield srgb_codes(_seen(shown, observer, place))

    with ProgressLine("clip") as line:
        encode(out, frames(), kind=kind("h264"), fps=clip.fps)
    return _observed(out, first, shown, observer)


def part_of(text: str) -> tuple[float, float, float, float]:
    """Return the part of a display that "X,Y,W,H" names, mm.

    Raises
    ------
    BadInput
        If these are not four numbers.
    """
    right, up, wide, high = numbers_of(text, ",", count=4, wanted="a part of the display as X,Y,W,H in mm")
    return right, up, wide, high


def _seen(shown: Shown, observer: Observer, place: Eye) -> NDArray[np.floating[Any]]:
    try:
        return look(shown.sheet, shown.display, place, observer.looking, window=observer.window(shown))
    except LayoutError as error:
        raise BadInput(error.message) from error


def _check_suffix(out: Path, suffix: str) -> None:
    if out.suffix.lower() != suffix:
        raise BadInput(f"expected a {suffix} in --out, got {out}")
    check_writable(out.parent)


def _observed(out: Path, picture: NDArray[np.floating[Any]], shown: Shown, observer: Observer) -> Observed:
    display, place = shown.display, observer.place
    return Observed(
        file=out,
        rows=picture.shape[0],
        cols=picture.shape[1],
        gap_mm=display.gap_mm,
        depths_times=display.gap_mm / display.focal_mm,
        viewing_zone_mm=viewing_zone_mm(
            pitch_mm=display.pitch_mm, gap_mm=display.gap_mm, distance_mm=place.distance_mm
        ),
        own_share=least_own_share(display, place, observer.looking),
    )
