"""Makers of videos with a motion of their own: of the eye, of the focus."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import groupby
from typing import Any

import numpy as np

from lippmann.job.outputs.clips import ClipOptions, FocusVideo, SweepVideo
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.observer.moving_eye import moving_eye
from lippmann.lightfield.observer.reach import ENDLESS_MM, reach_mm
from lippmann.lightfield.refocus.shift_and_sum import focal_stack
from lippmann.lightfield.views.perspective import Eye, perspective
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.optics.rig.bench import bench
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.registry import describes, makes
from worker.tasks.outputs.videos import Picture, encode_shown

PERIOD_S = 4.0
"""The default period of a motion, forth and back."""

MAX_STACK_PX = 2**24
"""The limit of the pixels of a focal stack: 200 MB, and the same again while it is computed."""


@makes(SweepVideo)
def make_sweep(context: OutputContext, output: SweepVideo) -> None:
    """Make the video of an eye that moves in front of the display."""
    frames = clip_frames(context.source, output)
    encode_shown(context, output, _swept(context.source, output, frames), count=len(frames), fps=output.fps)


@makes(FocusVideo)
def make_focus(context: OutputContext, output: FocusVideo) -> None:
    """Make the video of a focus that moves through depth."""
    frames = clip_frames(context.source, output)
    encode_shown(context, output, _focused(context.source, output, frames), count=len(frames), fps=output.fps)


@describes(FocusVideo)
def about_focus(source: FrameSource, output: FocusVideo) -> Mapping[str, Any]:
    """Describe the depths of the focus for the sidecar."""
    from_mm, to_mm = focus_depths(source, output)
    return {"from_mm": from_mm, "to_mm": to_mm, "depths": "s of the display: + in front of its lenses"}


def clip_frames(source: FrameSource, output: ClipOptions) -> tuple[int, ...]:
    """Return the frame that each picture of a clip shows."""
    frames = source.frames if output.frame is None else (output.frame,)
    sequence_s, seconds = len(frames) / source.fps, output.seconds
    if seconds is None:
        seconds = PERIOD_S * output.periods
        if len(frames) > 1:
            seconds = math.ceil(seconds / sequence_s) * sequence_s
    pictures = range(max(1, round(seconds * output.fps)))
    # A picture shows the frame whose time has begun; the millionth covers rounding.
    return tuple(frames[math.floor(picture / output.fps * source.fps + 1e-6) % len(frames)] for picture in pictures)


def focus_depths(source: FrameSource, output: FocusVideo) -> tuple[float, float]:
    """Return the first and last depth of the focus, mm: those of the output, else those of the scene.

    The depths of the scene are paraxial, a focal length in front of those at the array of the capture, and limited to
    the depths at which neighbouring views overlap.
    """
    first = source.frames[0]
    rig, stage = source.rig(first), source.stage(first)
    focal_mm = rig.lens_array.focal_length_mm
    near_mm = source.layout.px_per_lens * focal_mm
    far_mm = -near_mm
    if stage is not None:
        optical_bench = bench(rig, reference_mm=stage.reference_mm)
        far_mm, near_mm = optical_bench.s_mm(stage.far_mm) + focal_mm, optical_bench.s_mm(stage.near_mm) + focal_mm
    focal_lengths_mm = {source.rig(frame).lens_array.focal_length_mm for frame in source.frames}
    most_mm = source.layout.overlap_depth(min(focal_lengths_mm))
    far_mm, near_mm = (min(max(depth_mm, -most_mm), most_mm) for depth_mm in (far_mm, near_mm))
    from_mm = far_mm if output.from_mm is None else output.from_mm
    return from_mm, near_mm if output.to_mm is None else output.to_mm


def _swept(source: FrameSource, output: SweepVideo, frames: Sequence[int]) -> Iterator[Picture]:
    layout = source.layout

    @cache
    def path(pitch_mm: float, gap_mm: float) -> list[Eye]:
        return _path(layout, output, count=len(frames), pitch_mm=pitch_mm, gap_mm=gap_mm)

    for frame, pictures in _runs(frames, most=len(frames)):
        image = source.image(frame)
        eyes = path(image.pitch_mm, image.focal_length_mm)
        for picture in pictures:
            yield as_square(perspective(image, eyes[picture]).picture, layout)


def _path(layout: CellLayout, output: SweepVideo, *, count: int, pitch_mm: float, gap_mm: float) -> list[Eye]:
    middle = Eye(0.0, 0.0, output.distance_mm or ENDLESS_MM)
    right_mm, up_mm = reach_mm(layout, middle.distance_mm, pitch_mm=pitch_mm, gap_mm=gap_mm)
    reach = {"horizontal": right_mm, "vertical": up_mm, "circle": min(right_mm, up_mm)}[output.path]
    return list(
        moving_eye(middle, path=output.path, reach_mm=output.extent * reach, count=count, periods=output.periods)
    )


def _focused(source: FrameSource, output: FocusVideo, frames: Sequence[int]) -> Iterator[Picture]:
    depths_mm = np.linspace(*focus_depths(source, output), output.planes)
    turns = np.arange(len(frames)) * (2 * np.pi * output.periods / len(frames))
    planes = np.rint((1 - np.cos(turns)) / 2 * (output.planes - 1)).astype(int)
    for frame, pictures in _runs(frames, most=max(1, MAX_STACK_PX // math.prod(source.layout.square_size()))):
        shown, of_picture = np.unique(planes[pictures], return_inverse=True)
        stack = focal_stack(source.image(frame), depths_mm[shown].tolist())
        yield from (stack[place] for place in of_picture)


def _runs(frames: Sequence[int], *, most: int) -> Iterator[tuple[int, list[int]]]:
    """Yield each frame with the numbers of the successive pictures that show it, at most `most` at a time."""
    for frame, run in groupby(range(len(frames)), key=lambda picture: frames[picture]):
        pictures = list(run)
        for start in range(0, len(pictures), most):
            yield frame, pictures[start : start + most]
