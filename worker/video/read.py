"""Frames of a video file, one at a time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
from av.video.reformatter import ColorRange, Colorspace, Interpolation
from numpy.typing import NDArray

from lippmann.errors import ArtifactBroken, ArtifactMissing

_SMOOTH = Interpolation.BICUBIC | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT


def read_frames(path: Path) -> Iterator[NDArray[np.uint8]]:
    """Yield the frames of a video as sRGB codes `(rows, cols, 3)`.

    Raises
    ------
    ArtifactMissing
        If there is no such file.
    ArtifactBroken
        If it is not a video, or no frames can be made of it.

    Notes
    -----
    FFmpeg goes on where it can: a file cut short may just have fewer frames, and damage inside a frame is filled in
    from the frame before, with a line in its log and nothing else.
    """
    if not path.is_file():
        raise ArtifactMissing(f"expected a video at {path.name}, got no file")
    try:
        with av.open(str(path), "r") as container:
            if not container.streams.video:
                raise ArtifactBroken(f"{path.name}: expected a video, got none in the file")
            for frame in container.decode(video=0):
                yield _codes(frame)
    except av.FFmpegError as error:
        raise ArtifactBroken(f"{path.name}: {error.strerror}") from error


def _codes(frame: av.VideoFrame) -> NDArray[np.uint8]:
    if frame.format.is_rgb:
        return np.asarray(frame.to_ndarray(format="rgb24"), dtype=np.uint8)
    colours = frame.reformat(
        format="rgb24",
        src_colorspace=Colorspace.ITU709,
        src_color_range=ColorRange.MPEG,
        dst_color_range=ColorRange.JPEG,
        interpolation=_SMOOTH,
    )
    return np.asarray(colours.to_ndarray(), dtype=np.uint8)
