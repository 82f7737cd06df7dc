"""Frames through a codec and back, in memory, at one quantizer: what a study of coding measures.

| codec | is | quantizer |
|---|---|---|
| `x264` | H.264/AVC | QP 0 to 51 |
| `x265` | H.265/HEVC | QP 0 to 51 |
| `svtav1` | AV1, by SVT-AV1; 4:2:0 only | 0 to 63 |
| `vp9` | VP9, by libvpx | 0 to 63 |

The quantizer is the same for every frame: no rate control, no adaptive quantization, no offset between kinds of frames.
Quantizers of different codecs are different scales; only rate against distortion compares them. Frames go in as BT.709
in video range, 8 bits, and come back as sRGB codes, so what the chroma's resolution takes is part of the distortion.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, get_args

import av
import numpy as np
from av.video.reformatter import ColorRange, Colorspace, Interpolation, VideoReformatter
from numpy.typing import NDArray

from worker.errors import OutputError
from worker.video.size import even_sided

os.environ.setdefault("SVT_LOG", "1")  # SVT-AV1 tells standard error how it is set, unless only errors are wanted

CodecName = Literal["x264", "x265", "svtav1", "vp9"]
CODECS: tuple[CodecName, ...] = get_args(CodecName)
Chroma = Literal["420", "444"]

_EXACT = Interpolation.BICUBIC | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INP | Interpolation.BITEXACT
_SMOOTH = Interpolation.BICUBIC | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT
_TIME_BASE = Fraction(1, 30)
"""Any will do where no rate is controlled."""


@dataclass(frozen=True)
class _Codec:
    encoder: str
    decoder: str
    settings: Callable[[int, bool], dict[str, str]]
    """Of a quantizer, and whether every frame stands alone."""
    last_qp: int
    chroma: tuple[Chroma, ...] = ("420", "444")


def _x264(qp: int, intra: bool) -> dict[str, str]:
    every = ":keyint=1" if intra else ""
    return {"preset": "medium", "x264-params": f"qp={qp}:ipratio=1:pbratio=1:mbtree=0:aq-mode=0{every}"}


def _x265(qp: int, intra: bool) -> dict[str, str]:
    every = ":keyint=1" if intra else ""
    return {"preset": "medium", "x265-params": f"qp={qp}:ipratio=1:pbratio=1:cutree=0:aq-mode=0:log-level=none{every}"}


# Without fixed offsets SVT-AV1 takes a quantizer of its own for every layer of its pyramid of frames.
def _svtav1(qp: int, intra: bool) -> dict[str, str]:
    every = ":keyint=1" if intra else ""
    return {"preset": "6", "qp": str(qp), "svtav1-params": f"rc=0:aq-mode=0:use-fixed-qindex-offsets=1{every}"}


def _vp9(qp: int, intra: bool) -> dict[str, str]:
    every = {"g": "1"} if intra else {}
    return {"qmin": str(qp), "qmax": str(qp), "crf": str(qp), "b": "0", "cpu-used": "2", "aq-mode": "0", **every}


_CODECS: Mapping[CodecName, _Codec] = {
    "x264": _Codec("libx264", "h264", _x264, 51),
    "x265": _Codec("libx265", "hevc", _x265, 51),
    "svtav1": _Codec("libsvtav1", "libdav1d", _svtav1, 63, ("420",)),
    "vp9": _Codec("libvpx-vp9", "vp9", _vp9, 63),
}


@dataclass(frozen=True)
class Coded:
    """A sequence after a codec."""

    codec: CodecName
    rows: int
    cols: int
    """Of a frame as it was given."""
    packets: tuple[bytes, ...]

    @property
    def bits(self) -> int:
        """Of all packets; a container would add its own."""
        return 8 * sum(map(len, self.packets))

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        """Yield the frames, `(rows, cols, 3)`, sRGB codes, in the order in which they went in.

        Raises
        ------
        OutputError
            If the codec cannot read what it wrote.
        """
        reformatter = VideoReformatter()
        try:
            decoder = av.CodecContext.create(_CODECS[self.codec].decoder, "r")
            assert isinstance(decoder, av.VideoCodecContext)  # noqa: S101 - what these codecs are
            for packet in (*map(av.Packet, self.packets), None):
                for frame in decoder.decode(packet):
                    yield _codes(reformatter, frame)[: self.rows, : self.cols]
        except av.FFmpegError as error:
            raise OutputError(f"{self.codec} cannot read what it wrote: {error.strerror}") from error


def check_codec(codec: CodecName, *, qp: int, chroma: Chroma) -> None:
    """Refuse a quantizer or a chroma that a codec does not have.

    Raises
    ------
    OutputError
        Naming what it has.

    Examples
    --------
    >>> check_codec("svtav1", qp=30, chroma="444")
    Traceback (most recent call last):
        ...
    worker.errors.OutputError: expected chroma 420 for svtav1, got 444
    """
    has = _CODECS[codec]
    if chroma not in has.chroma:
        raise OutputError(f"expected chroma {' or '.join(has.chroma)} for {codec}, got {chroma}")
    if not 0 <= qp <= has.last_qp:
        raise OutputError(f"expected a quantizer from 0 to {has.last_qp} for {codec}, got {qp}")


def code(
    frames: Iterable[NDArray[np.uint8]], *, codec: CodecName, qp: int, chroma: Chroma = "420", intra: bool = False
) -> Coded:
    """Return frames after a codec.

    Parameters
    ----------
    frames
        `(rows, cols, 3)`, sRGB codes, all of one shape, taken one at a time. Odd sides are made even for the codec: the
        last row or col is shown twice, and taken away afterwards.
    codec, qp
        Which, and its quantizer for every frame.
    chroma
        4:2:0 halves the resolution of the chroma each way, 4:4:4 keeps it.
    intra
        Whether every frame stands alone.

    Raises
    ------
    OutputError
        As `check_codec`, or if there are no frames, they differ in shape, or the codec refuses them.
    """
    check_codec(codec, qp=qp, chroma=chroma)
    has, reformatter = _CODECS[codec], VideoReformatter()
    encoder: av.VideoCodecContext | None = None
    packets: list[bytes] = []
    shape: tuple[int, ...] = ()
    try:
        for number, codes in enumerate(frames):
            shape = shape or codes.shape
            if codes.shape != shape:
                raise OutputError(f"expected frames {shape} like the first, got {codes.shape} as {number}")
            frame = _yuv(reformatter, codes, f"yuv{chroma}p")
            frame.pts, frame.time_base = number, _TIME_BASE
            encoder = encoder or _encoder(has, frame, has.settings(qp, intra))
            packets += map(bytes, encoder.encode(frame))
        if encoder is None:
            raise OutputError("expected at least one frame to code, got none")
        packets += map(bytes, encoder.encode(None))
    except av.FFmpegError as error:
        raise OutputError(f"{codec} refuses frames of {shape}: {error.strerror}") from error
    return Coded(codec, shape[0], shape[1], tuple(packets))


def _encoder(has: _Codec, frame: av.VideoFrame, settings: dict[str, str]) -> av.VideoCodecContext:
    encoder = av.CodecContext.create(has.encoder, "w")
    assert isinstance(encoder, av.VideoCodecContext)  # noqa: S101 - what these codecs are
    encoder.width, encoder.height, encoder.pix_fmt = frame.width, frame.height, frame.format.name
    encoder.time_base, encoder.framerate, encoder.options = _TIME_BASE, 1 / _TIME_BASE, settings
    return encoder


def _yuv(reformatter: VideoReformatter, codes: NDArray[np.uint8], pixel_format: str) -> av.VideoFrame:
    rgb = av.VideoFrame.from_ndarray(np.ascontiguousarray(even_sided(codes)), format="rgb24")
    return reformatter.reformat(
        rgb,
        format=pixel_format,
        src_color_range=ColorRange.JPEG,
        dst_colorspace=Colorspace.ITU709,
        dst_color_range=ColorRange.MPEG,
        interpolation=_EXACT,
    )


def _codes(reformatter: VideoReformatter, frame: av.VideoFrame) -> NDArray[np.uint8]:
    rgb = reformatter.reformat(
        frame,
        format="rgb24",
        src_colorspace=Colorspace.ITU709,
        src_color_range=ColorRange.MPEG,
        dst_color_range=ColorRange.JPEG,
        interpolation=_SMOOTH,
    )
    return np.asarray(rgb.to_ndarray(), dtype=np.uint8)
