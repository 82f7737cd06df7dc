"""Makers of videos and pictures of what an observer of the display sees."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.outputs.observer import ObserverOptions, ObserverPictures, ObserverVideo
from lippmann.lightfield.observer.display import LensDisplay
from lippmann.lightfield.observer.moving_eye import moving_eye
from lippmann.lightfield.observer.observe import whole_window
from lippmann.lightfield.observer.viewing_conditions import ViewingConditions, observed_picture
from lippmann.lightfield.views.perspective import Eye
from lippmann.optics.rig.display import central_depth_plane_mm, viewing_zone_mm
from lippmann.plan import artifact_names as names
from lippmann.plan.design.observed_display import observed_display, used_gap_mm
from worker.images.write import write_png
from worker.tasks.frames.assemble import on_device
from worker.tasks.outputs.clips import clip_frames
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.registry import describes, makes
from worker.tasks.outputs.videos import Picture, encode_pixels


@makes(ObserverVideo)
def make_observer(context: OutputContext, output: ObserverVideo) -> None:
    """Make the video of an eye that moves while the frames play."""
    moments = clip_moments(context.source, output)
    pictures = _clip(context.source, output, moments)
    encode_pixels(context, output, pictures, count=len(moments), fps=output.fps)


@makes(ObserverPictures)
def make_observer_pictures(context: OutputContext, output: ObserverPictures) -> None:
    """Make a picture of what the observer sees of every frame."""
    source = context.source
    for frame in context.with_progress(source.frames, len(source.frames)):
        context.store_file(
            f"{names.frame_stem(frame)}{output.suffix}",
            partial(_write_picture, source=source, output=output, frame=frame),
        )


@describes(ObserverVideo, ObserverPictures)
def about_observer(source: FrameSource, output: ObserverOptions) -> Mapping[str, Any]:
    """Describe the display and the eye at the first frame for the sidecar."""
    display, place = observed(source, output, source.frames[0]), place_of(source, output)
    plane_mm = central_depth_plane_mm(focal_length_mm=display.focal_mm, gap_mm=display.gap_mm)
    zone = {"pitch_mm": display.pitch_mm, "gap_mm": display.gap_mm, "distance_mm": place.distance_mm}
    high_mm, wide_mm = display.array_mm
    return {
        "plane": "of the lenses: the picture shows what is seen through it, all of the array, row 0 at its top",
        "width_mm": wide_mm,
        "height_mm": high_mm,
        "eye_mm": [place.x_mm, place.y_mm, place.distance_mm],
        "gap_mm": display.gap_mm,
        "depths_times": display.gap_mm / display.focal_mm,
        "central_depth_plane_mm": plane_mm if math.isfinite(plane_mm) else None,
        "viewing_zone_mm": viewing_zone_mm(**zone),
    }


@dataclass(frozen=True)
class Moment:
    """The frame and the eye of one picture of a clip."""

    frame: int
    place: Eye


def clip_moments(source: FrameSource, output: ObserverVideo) -> tuple[Moment, ...]:
    """Return the frame and the eye of each picture of a clip.

    Raises
    ------
    LayoutError
        If the eye would reach the display.
    """
    frames = clip_frames(source, output)
    places = moving_eye(
        place_of(source, output),
        path=output.path,
        reach_mm=output.reach_mm,
        count=len(frames),
        periods=output.periods,
    )
    return tuple(Moment(frame, eye) for frame, eye in zip(frames, places, strict=True))


def place_of(source: FrameSource, output: ObserverOptions) -> Eye:
    """Return the place of the eye, or the middle between two eyes."""
    distance_mm = output.distance_mm or source.display.viewing_distance_mm
    return Eye(x_mm=output.x_mm, y_mm=output.y_mm, distance_mm=distance_mm)


def observed(source: FrameSource, output: ObserverOptions, frame: int) -> LensDisplay:
    """Return the display that shows a frame.

    Raises
    ------
    LayoutError
        If it cannot be built.
    """
    rig = source.rig(frame)
    gap_mm = used_gap_mm(rig, source.display, output.gap, stage=source.stage(frame))
    return observed_display(rig, gap_mm=gap_mm, on_device=output.device, bare=output.bare, surround=output.surround)


@dataclass(frozen=True)
class _Scene:
    """A frame shown on the display."""

    sheet: NDArray[np.floating[Any]]
    display: LensDisplay

    @classmethod
    def of(cls, source: FrameSource, output: ObserverOptions, frame: int) -> _Scene:
        display, device, sheet = (
            observed(source, output, frame),
            source.rig(frame).device,
            source.image(frame).pixels,
        )
        if output.device and device is not None:
            sheet = on_device(sheet, display.layout, device, pitch_mm=display.pitch_mm)
        # The sheet is read many times, and half floats are slow to calculate with.
        return cls(sheet.astype(np.float32), display)

    def picture_at(self, output: ObserverOptions, place: Eye) -> NDArray[np.floating[Any]]:
        conditions = ViewingConditions(
            pupil_mm=output.pupil_mm,
            focus_mm=output.focus_mm,
            rays=output.rays,
            stereo=output.stereo,
            eye_distance_mm=output.eye_distance_mm,
        )
        window = whole_window(self.display, size_px=output.size_px)
        return observed_picture(self.sheet, self.display, place, conditions, window=window)


def _clip(source: FrameSource, output: ObserverVideo, moments: tuple[Moment, ...]) -> Iterator[Picture]:
    frame, scene = 0, None
    for moment in moments:
        if scene is None or moment.frame != frame:
            frame, scene = moment.frame, _Scene.of(source, output, moment.frame)
        yield scene.picture_at(output, moment.place)


def _write_picture(path: Path, *, source: FrameSource, output: ObserverPictures, frame: int) -> None:
    scene = _Scene.of(source, output, frame)
    write_png(path, scene.picture_at(output, place_of(source, output)), bits=output.bits)
