"""Frames to a file, one at a time: never more than one frame and the encoder's own few are in memory.

| kind | for | what is in it |
|---|---|---|
| `H264` | people: browsers, players | MP4, 4:2:0, BT.709 in video range: converted so, tagged so; index in front |
| `FFV1` | work: the integral video | Matroska, 8-bit RGB, every code as it was given, checked by CRCs |

The same frames give the same bytes: no dates, no random numbers, and a fixed number of threads, which x264's bits
depend on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Literal

import av
import numpy as np
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc, Interpolation, VideoReformatter
from av.video.stream import VideoStream
from numpy.typing import NDArray

from worker.errors import NO_ROOM, OutputError, StoreFull, StoreUnavailable
from worker.video.size import even_sided

Frame = NDArray[np.uint8]
"""`(rows, cols, 3)`: sRGB codes."""

_EXACT = Interpolation.BICUBIC | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INP | Interpolation.BITEXACT


@dataclass(frozen=True)
class Kind:
    """A container, a codec and how they are set."""

    container: str
    codec: Literal["libx264", "ffv1"]
    pixel_format: str
    settings: dict[str, str]
    container_settings: dict[str, str] = field(default_factory=dict)


H264 = Kind(
    container="mp4",
    codec="libx264",
    pixel_format="yuv420p",
    # x264's macroblock tree reads what it has not written when the picture is small (the bits differ from run to run,
    # measured at 64 x 64 px), so it is off.
    settings={"crf": "17", "preset": "fast", "x264-params": "mbtree=0", "threads": "2", "flags": "+bitexact"},
    container_settings={"movflags": "+faststart", "fflags": "+bitexact"},
)
FFV1 = Kind(
    container="matroska",
    codec="ffv1",
    pixel_format="bgr0",
    settings={"level": "3", "g": "1", "slices": "4", "slicecrc": "1", "threads": "2", "flags": "+bitexact"},
    container_settings={"fflags": "+bitexact"},
)


def encode(path: Path, frames: Iterable[Frame], *, kind: Kind, fps: float, scale: int = 1) -> None:
    """Write frames as a video.

    Parameters
    ----------
    path
        Where to; not atomic. The name's ending does not matter.
    frames
        Taken one at a time; all of the first one's shape. In 4:2:0 an odd last row or col is shown twice.
    kind
        `H264` or `FFV1`.
    fps
        Frames a second; carried as the nearest fraction with a denominator of at most 1001.
    scale
        How many times larger the video is than its frames, each way; only for people (`H264`). Enlarged by a bicubic
        filter, on sRGB codes: a preview, and 40 times cheaper than in linear light (measured at 90 to 720 px).

    Raises
    ------
    OutputError
        If there are no frames, they differ in shape, or they cannot be encoded.
    StoreFull, StoreUnavailable
        If the disk is full, or the folder cannot be written to. Nothing is left behind then.
    """
    rate = frame_rate(fps)
    pictures = _pictures(frames)
    first = next(pictures, None)
    if first is None:
        raise OutputError("expected at least one frame for a video, got none")
    try:
        _write(path, chain([first], pictures), kind, rate, scale)
    except BaseException as error:
        path.unlink(missing_ok=True)
        if not isinstance(error, av.FFmpegError):
            raise
        raise _translated(error, path) from error


def frame_rate(fps: float) -> Fraction:
    """Return frames a second as a fraction that video files can carry.

    Examples
    --------
    >>> frame_rate(8.0), frame_rate(30000 / 1001)
    (Fraction(8, 1), Fraction(30000, 1001))
    """
    rate = Fraction(fps).limit_denominator(1001)
    if rate <= 0:
        raise OutputError(f"expected at least 1/1001 frames a second, got {fps}")
    return rate


def _pictures(frames: Iterable[Frame]) -> Iterator[NDArray[np.uint8]]:
    shape: tuple[int, ...] | None = None
    for number, frame in enumerate(frames):
        shape = shape or frame.shape
        if frame.ndim != 3 or frame.shape[2] != 3 or frame.shape != shape or frame.size == 0:
            raise OutputError(f"expected frames {shape} like the first, (rows, cols, 3), got {frame.shape} as {number}")
        if frame.dtype != np.uint8:
            raise OutputError(f"expected sRGB codes as uint8, got {frame.dtype}")
        yield frame


def _write(path: Path, pictures: Iterable[NDArray[np.uint8]], kind: Kind, rate: Fraction, scale: int) -> None:
    reformatter = VideoReformatter()
    with av.open(str(path), "w", format=kind.container, container_options=dict(kind.container_settings)) as container:
        stream: VideoStream | None = None
        for number, picture in enumerate(pictures):
            frame = _frame(reformatter, picture, kind, scale)
            stream = stream or _stream(container, frame, kind, rate)
            frame.pts, frame.time_base = number, 1 / rate
            container.mux(stream.encode(frame))
        if stream is not None:
            container.mux(stream.encode(None))


def _stream(container: av.container.OutputContainer, frame: av.VideoFrame, kind: Kind, rate: Fraction) -> VideoStream:
    stream = container.add_stream(kind.codec, rate=rate, options=dict(kind.settings))
    stream.width, stream.height, stream.pix_fmt = frame.width, frame.height, kind.pixel_format
    stream.codec_context.time_base = 1 / rate
    stream.color_primaries = ColorPrimaries.BT709
    if kind is H264:
        stream.color_range, stream.colorspace, stream.color_trc = ColorRange.MPEG, Colorspace.ITU709, ColorTrc.BT709
    else:
        stream.color_range, stream.color_trc = ColorRange.JPEG, ColorTrc.IEC61966_2_1
    return stream


def _frame(reformatter: VideoReformatter, picture: NDArray[np.uint8], kind: Kind, scale: int) -> av.VideoFrame:
    if kind is not H264:
        codes = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
        return reformatter.reformat(codes, format=kind.pixel_format)
    even = picture if scale % 2 == 0 else even_sided(picture)  # an even scale makes sides even by itself
    codes = av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format="rgb24")
    return reformatter.reformat(
        codes,
        width=codes.width * scale,
        height=codes.height * scale,
        format=kind.pixel_format,
        src_color_range=ColorRange.JPEG,
        dst_colorspace=Colorspace.ITU709,
        dst_color_range=ColorRange.MPEG,
        interpolation=_EXACT,
    )


def _translated(error: av.FFmpegError, path: Path) -> OutputError | StoreFull | StoreUnavailable:
    message = f"cannot write {path.name}: {error.strerror}"
    if error.errno in NO_ROOM:
        return StoreFull(message)
    if isinstance(error, OSError):
        return StoreUnavailable(message)
    return OutputError(message)
