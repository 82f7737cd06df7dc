"""The choices of codecs for videos; `worker.video.kinds` has their settings for FFmpeg."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Codec = Literal["h264", "h265", "av1", "vp9", "ffv1"]
Container = Literal["mp4", "webm", "mkv"]
Chroma = Literal["4:2:0", "4:4:4"]
Bits = Literal[8, 10, 16]


@dataclass(frozen=True)
class Choices:
    """The choices for a codec; the first of each is the default."""

    containers: tuple[Container, ...]
    bits: tuple[Bits, ...] = (8,)
    chroma: tuple[Chroma, ...] = ("4:2:0", "4:4:4")
    """The chroma subsamplings; empty if red, green and blue are kept."""
    crf: int | None = None
    """The default of the constant rate factor, from 1, the best; None for lossless codecs."""
    worst_crf: int = 0


CHOICES: Mapping[Codec, Choices] = {
    "h264": Choices(("mp4", "mkv"), crf=17, worst_crf=51),
    "h265": Choices(("mp4", "mkv"), crf=20, worst_crf=51),
    "av1": Choices(("mp4", "webm", "mkv"), bits=(8, 10), chroma=("4:2:0",), crf=28, worst_crf=63),
    "vp9": Choices(("webm", "mkv"), crf=30, worst_crf=63),
    "ffv1": Choices(("mkv",), bits=(8, 10, 16), chroma=()),
}
"""Every codec of a video. The default rate factors give the same quality: 38 dB on views of the fish, enlarged (PSNR of
red, green and blue, 4:2:0 against what was encoded, measured)."""
