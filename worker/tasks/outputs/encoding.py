"""Pictures of linear light into the one file of a video, enlarged for people or pixel for pixel."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.outputs.videos import ShownVideo, VideoOptions
from worker.images.colour import srgb_codes
from worker.images.resize import resize
from worker.tasks.outputs.making import Making
from worker.video.encode import Frame, Scale, encode
from worker.video.kinds import kind
from worker.video.size import screen_scale

Picture = NDArray[np.floating[Any]]
"""`(rows, cols, 3)`, linear light."""

KEPT_BYTES = 2**28
"""Of pictures that are shown again: as many as there is room for."""


def encode_pixels(
    making: Making, output: VideoOptions, pictures: Iterable[Picture], *, count: int, fps: float, scale: Scale = 1
) -> None:
    """Encode `count` pictures as they are, or enlarged on their codes."""
    _encode(making, output, (srgb_codes(picture, bits=output.bits) for picture in pictures), count, fps, scale)


def encode_shown(
    making: Making,
    output: ShownVideo,
    pictures: Iterable[Picture],
    *,
    count: int,
    fps: float,
    half_width: bool = False,
) -> None:
    """Encode `count` pictures that are as small as views as large as the output says, or half as wide."""
    down = output.scale or _usual_scale(making, output)
    if half_width:
        down += down % 2
    across = down // 2 if half_width else down
    if output.filter == "bicubic":
        encode_pixels(making, output, pictures, count=count, fps=fps, scale=(down, across))
        return
    enlarged = (
        resize(picture, rows=picture.shape[0] * down, cols=picture.shape[1] * across, filter_name=output.filter)
        for picture in pictures
    )
    encode_pixels(making, output, enlarged, count=count, fps=fps)


def again(make: Callable[[], Iterable[Picture]], times: int) -> Iterator[Picture]:
    """Yield pictures and then the same again: kept while they are few, else made anew each time."""
    kept: list[Picture] = []
    room = KEPT_BYTES if times > 1 else 0
    for picture in make():
        room -= picture.nbytes
        if room >= 0:
            kept.append(picture.copy())  # a view would keep its whole sheet
        else:
            kept.clear()
        yield picture
    for _ in range(times - 1):
        yield from kept if room >= 0 else make()


def _usual_scale(making: Making, output: ShownVideo) -> int:
    return 1 if output.codec == "ffv1" else screen_scale(*making.footage.layout.square_size())


def _encode(
    making: Making, output: VideoOptions, frames: Iterable[Frame], count: int, fps: float, scale: Scale
) -> None:
    watched = making.told(frames, count)
    set_up = kind(output.codec, container=output.container, crf=output.crf, chroma=output.chroma, bits=output.bits)

    def write(path: Path) -> None:
        encode(path, watched, kind=set_up, fps=fps, scale=scale)

    making.keep(output.file_name, write)
