"""Makers of videos of views and of integral images, and the encoding of pictures for all kinds of video."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.outputs.videos import (
    CentreVideo,
    IntegralVideo,
    OrthoscopicVideo,
    ShownVideo,
    VideoOptions,
    ViewsVideo,
)
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, successive_views, view, view_numbers
from worker.images.colour import srgb_codes
from worker.images.resize import resize
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.registry import makes
from worker.video.encode import Frame, Scale, encode
from worker.video.kinds import kind
from worker.video.size import screen_scale

Picture = NDArray[np.floating[Any]]
"""A picture `(rows, cols, 3)` in linear light."""

KEPT_BYTES = 2**28
"""The limit of the memory of pictures that are repeated."""


def encode_pixels(
    context: OutputContext,
    output: VideoOptions,
    pictures: Iterable[Picture],
    *,
    count: int,
    fps: float,
    scale: Scale = 1,
) -> None:
    """Encode `count` pictures pixel for pixel, or enlarged as sRGB codes."""
    _encode(context, output, (srgb_codes(picture, bits=output.bits) for picture in pictures), count, fps, scale)


def encode_shown(
    context: OutputContext,
    output: ShownVideo,
    pictures: Iterable[Picture],
    *,
    count: int,
    fps: float,
    half_width: bool = False,
) -> None:
    """Encode `count` pictures of the size of views, enlarged by the scale of the output, or to half that width."""
    down = output.scale or _usual_scale(context, output)
    if half_width:
        down += down % 2
    across = down // 2 if half_width else down
    if output.filter == "bicubic":
        encode_pixels(context, output, pictures, count=count, fps=fps, scale=(down, across))
        return
    enlarged = (
        resize(picture, rows=picture.shape[0] * down, cols=picture.shape[1] * across, filter_name=output.filter)
        for picture in pictures
    )
    encode_pixels(context, output, enlarged, count=count, fps=fps)


def again(make: Callable[[], Iterable[Picture]], times: int) -> Iterator[Picture]:
    """Yield pictures several times: they are kept in memory if they fit in `KEPT_BYTES`, else made again."""
    kept: list[Picture] = []
    room = KEPT_BYTES if times > 1 else 0
    for picture in make():
        room -= picture.nbytes
        if room >= 0:
            kept.append(picture.copy())  # an array view would keep its whole sheet in memory
        else:
            kept.clear()
        yield picture
    for _ in range(times - 1):
        yield from kept if room >= 0 else make()


def _usual_scale(context: OutputContext, output: ShownVideo) -> int:
    return 1 if output.codec == "ffv1" else screen_scale(*context.source.layout.square_size())


def _encode(
    context: OutputContext, output: VideoOptions, frames: Iterable[Frame], count: int, fps: float, scale: Scale
) -> None:
    watched = context.with_progress(frames, count)
    set_up = kind(output.codec, container=output.container, crf=output.crf, chroma=output.chroma, bits=output.bits)

    def write(path: Path) -> None:
        encode(path, watched, kind=set_up, fps=fps, scale=scale)

    context.store_file(output.file_name, write)


@makes(ViewsVideo)
def make_views(context: OutputContext, output: ViewsVideo) -> None:
    """Make the video of all views of every frame in succession."""
    source = context.source
    count = len(source.frames) * len(view_numbers(source.layout))
    encode_shown(context, output, _all_views(source), count=count, fps=output.views_per_s)


@makes(CentreVideo)
def make_centre(context: OutputContext, output: CentreVideo) -> None:
    """Make the video of the centre view."""
    source, layout = context.source, context.source.layout

    def views() -> Iterator[Picture]:
        for frame in source.frames:
            yield as_square(view(source.image(frame).pixels, layout, *centre(layout)), layout)

    count = len(source.frames) * output.repeat
    encode_shown(context, output, again(views, output.repeat), count=count, fps=source.fps)


@makes(OrthoscopicVideo)
def make_orthoscopic(context: OutputContext, output: OrthoscopicVideo) -> None:
    """Make the orthoscopic integral video."""
    source = context.source
    sheets = (source.image(frame).pixels for frame in source.frames)
    encode_pixels(context, output, sheets, count=len(source.frames), fps=source.fps)


@makes(IntegralVideo)
def make_integral(context: OutputContext, output: IntegralVideo) -> None:
    """Make the integral video as captured, pseudoscopic."""
    source = context.source
    sheets = (source.integral(frame) for frame in source.frames)
    encode_pixels(context, output, sheets, count=len(source.frames), fps=source.fps)


def _all_views(source: FrameSource) -> Iterator[Picture]:
    layout = source.layout
    for number, frame in enumerate(source.frames):
        sheet = source.image(frame).pixels
        for u, v in successive_views(layout, backward=number % 2 == 1):
            yield as_square(view(sheet, layout, u, v), layout)
