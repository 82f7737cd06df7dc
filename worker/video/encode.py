"""Write frames to a video file one at a time: only one frame and the encoder's own few are in memory.

A `Kind` is a codec in a container with its settings: see `kinds`. Stream and container both carry four colour facts:

========= ================================================== =====================================
fact      H.264, H.265, AV1, VP9                             FFV1
========= ================================================== =====================================
primaries BT.709, which are those of sRGB                    BT.709
transfer  sRGB (IEC 61966-2-1): the codes are not converted  sRGB
matrix    BT.709: Y'CbCr of the sRGB codes                   identity: red, green and blue are kept
range     video range, 16 to 235                             full range
========= ================================================== =====================================
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from fractions import Fraction
from itertools import chain
from pathlib import Path

import av
import numpy as np
from av.packet import Packet
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc, Interpolation, VideoReformatter
from av.video.stream import VideoStream
from numpy.typing import NDArray

from lippmann.errors import NO_ROOM, DiskFull, DiskUnavailable, OutputError
from worker.video.kinds import Kind
from worker.video.size import at_least, even_sided

Frame = NDArray[np.uint8] | NDArray[np.uint16]
"""`(rows, cols, 3)`: sRGB codes, uint8 for 8 bits, uint16 for more."""

Scale = int | tuple[int, int]

_GIVEN = {8: "rgb24", 10: "gbrp10le", 16: "gbrp16le"}
"""The pixel formats of the frames that are passed in, by their bits."""

LEAST_SLICED_PX = 2
"""The four slices of FFV1 are two by two, so a picture with a shorter side has only one."""

_GBR = 0
"""FFmpeg's AVCOL_SPC_RGB (H.273: identity), for which PyAV has no name."""

_X265_REORDERS = 2
"""The frames by which x265 decodes ahead (its B-frame pyramid): for clips of one or two frames its decoding times are
undefined, and such times cannot be written (4.2, measured)."""

_EXACT = Interpolation.BICUBIC | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INP | Interpolation.BITEXACT


def encode(path: Path, frames: Iterable[Frame], *, kind: Kind, fps: float, scale: Scale = 1) -> tuple[int, ...]:
    """Write frames as a video.

    Parameters
    ----------
    path
        The file; writing it is not atomic. Its suffix does not matter.
    frames
        Taken one at a time; all of the first one's shape. In 4:2:0 an odd last row or col is shown twice; a picture
        that is too small for the encoder is continued by its last row and col.
    kind
        The codec, its container and settings.
    fps
        Frames a second; carried as the nearest fraction with a denominator of at most 1001.
    scale
        The scale of the video to its frames, in both directions or as (down, across). Frames are enlarged by a bicubic
        filter, on sRGB codes: a preview, and 40 times cheaper than in linear light (measured at 90 to 720 px).

    Returns
    -------
    tuple of int
        The bytes of every frame as the encoder gives them, in the order in which they are shown. A container may frame
        them by a few bytes more or less.

    Raises
    ------
    OutputError
        If there are no frames, they differ in shape, or they cannot be encoded.
    DiskFull, DiskUnavailable
        If the disk is full, or the folder cannot be written to. Nothing is left behind then.
    """
    rate = frame_rate(fps)
    pictures = _pictures(frames, kind)
    first = next(pictures, None)
    if first is None:
        raise OutputError("expected at least one frame for a video, got none")
    try:
        return _write(path, chain([first], pictures), kind, rate, scale)
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


def _pictures(frames: Iterable[Frame], kind: Kind) -> Iterator[Frame]:
    shape: tuple[int, ...] | None = None
    dtype = np.dtype(np.uint8 if kind.bits == 8 else np.uint16)
    for number, frame in enumerate(frames):
        shape = shape or frame.shape
        if frame.ndim != 3 or frame.shape[2] != 3 or frame.shape != shape or frame.size == 0:
            raise OutputError(f"expected frames {shape} like the first, (rows, cols, 3), got {frame.shape} as {number}")
        if frame.dtype != dtype:
            raise OutputError(f"expected sRGB codes of {kind.bits} bits as {dtype}, got {frame.dtype}")
        yield frame


def _write(path: Path, pictures: Iterable[Frame], kind: Kind, rate: Fraction, scale: Scale) -> tuple[int, ...]:
    os.environ.setdefault("SVT_LOG", "1")  # SVT-AV1 otherwise prints information on stderr: now only errors
    converted, sizes = VideoReformatter(), dict[int, int]()
    with av.open(str(path), "w", format=kind.muxer, container_options=dict(kind.muxer_settings)) as container:
        stream: VideoStream | None = None

        def keep(packets: Iterable[Packet[VideoStream]]) -> None:
            for packet in packets:
                if kind.encoder == "libx265":
                    packet.dts = len(sizes) - _X265_REORDERS
                sizes[packet.pts or 0] = packet.size
                container.mux(packet)

        for number, picture in enumerate(pictures):
            frame = _frame(converted, picture, kind, scale)
            if stream is None:
                stream = _stream(container, frame, kind, rate)
                with _ordinary_priority():
                    stream.codec_context.open(strict=False)
            frame.pts, frame.time_base = number, 1 / rate
            keep(stream.encode(frame))
        if stream is not None:
            keep(stream.encode(None))
    return tuple(size for _, size in sorted(sizes.items()))


def _stream(container: av.container.OutputContainer, frame: av.VideoFrame, kind: Kind, rate: Fraction) -> VideoStream:
    options = dict(kind.settings)
    if "slices" in options and min(frame.width, frame.height) < LEAST_SLICED_PX:
        options["slices"] = "1"
    stream = container.add_stream(kind.encoder, rate=rate, options=options)
    assert isinstance(stream, VideoStream)  # noqa: S101 - all our encoders are
    stream.width, stream.height, stream.pix_fmt = frame.width, frame.height, kind.pixel_format
    stream.codec_context.time_base = 1 / rate
    if (kind.encoder, kind.container) == ("libx265", "mp4"):
        stream.codec_context.codec_tag = "hvc1"  # FFmpeg writes hev1, which Apple's players refuse
    stream.color_primaries, stream.color_trc = ColorPrimaries.BT709, ColorTrc.IEC61966_2_1
    if kind.is_rgb:
        stream.color_range, stream.colorspace = ColorRange.JPEG, _GBR
    else:
        stream.color_range, stream.colorspace = ColorRange.MPEG, Colorspace.ITU709
    return stream


@contextmanager
def _ordinary_priority() -> Iterator[None]:
    """Keep the scheduling of this process while an encoder is opened.

    If root runs it, SVT-AV1 gives its caller and its own threads a real-time priority, for good. A process that
    computes at such a priority keeps everything else from the machine, even its own broker.
    """
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        yield
    finally:
        for thread in Path("/proc/self/task").iterdir():
            with suppress(ProcessLookupError):  # the thread has ended meanwhile
                if os.sched_getscheduler(int(thread.name)) == os.SCHED_FIFO != policy:
                    os.sched_setscheduler(int(thread.name), policy, parameters)


def _frame(converted: VideoReformatter, picture: Frame, kind: Kind, scale: Scale) -> av.VideoFrame:
    down, across = scale if isinstance(scale, tuple) else (scale, scale)
    least_px = kind.least_side_px
    large = at_least(picture, rows=-(-least_px // down), cols=-(-least_px // across))
    # An even scale makes sides even by itself.
    even = even_sided(large, down=down % 2 == 1, across=across % 2 == 1) if kind.needs_even_sides else large
    codes = av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format=_GIVEN[kind.bits])
    if codes.format.name == kind.pixel_format and down == across == 1:
        return codes
    matrix = {} if kind.is_rgb else {"dst_colorspace": Colorspace.ITU709}
    return converted.reformat(
        codes,
        width=codes.width * across,
        height=codes.height * down,
        format=kind.pixel_format,
        src_color_range=ColorRange.JPEG,
        dst_color_range=ColorRange.JPEG if kind.is_rgb else ColorRange.MPEG,
        interpolation=_EXACT,
        **matrix,
    )


def _translated(error: av.FFmpegError, path: Path) -> OutputError | DiskFull | DiskUnavailable:
    message = f"cannot write {path.name}: {error.strerror}"
    if error.errno in NO_ROOM:
        return DiskFull(message)
    if isinstance(error, OSError):
        return DiskUnavailable(message)
    return OutputError(message)
