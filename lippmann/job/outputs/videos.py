"""Videos: one file for the whole job."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from lippmann.job.fields.problems import FieldError
from lippmann.job.optics.rig import Rig
from lippmann.job.optics.viewing import Filter
from lippmann.job.outputs.codecs import CHOICES, Bits, Chroma, Codec, Container
from lippmann.job.outputs.output import Name, OutputOptions, output_kind

MAX_SHOWN_PX = 8192
"""The longest side of a video for people, which players and graphics cards can decode."""

Fps = Annotated[float, Field(gt=0, le=240)]
Repeat = Annotated[int, Field(ge=1, le=1000)]
"""The number of times that the sequence is shown."""


class VideoOptions(OutputOptions):
    """The base of all videos."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        ".mp4": {"codec": "h264"},
        ".webm": {"codec": "vp9"},
        ".mkv": {"codec": "ffv1"},
    }
    IS_VIDEO: ClassVar[bool] = True

    codec: Codec = "h264"
    """The codec of the video; `ffv1` is lossless."""
    container: Container | None = None
    """The container; the default is the first one of the codec."""
    crf: int | None = Field(default=None, ge=1)
    """The encoder's own constant rate factor: 1 is the best."""
    chroma: Chroma | None = None
    """The chroma subsampling; the default is the first one of the codec."""
    bits: Bits = 8
    """The bits of each colour channel."""

    @model_validator(mode="after")
    def _codec_can(self) -> Self:
        choices, codec = CHOICES[self.codec], self.codec
        no_chroma, no_crf = f"none for {codec}, which keeps RGB", f"none for {codec}, which loses nothing"
        if self.container not in (None, *choices.containers):
            raise FieldError(
                "container", expected=f"{_one_of(choices.containers)} for {codec}", got=repr(self.container)
            )
        if self.bits not in choices.bits:
            raise FieldError("bits", expected=f"{_one_of(choices.bits)} for {codec}", got=self.bits)
        if self.chroma not in (None, *choices.chroma):
            expected = f"{_one_of(choices.chroma)} for {codec}" if choices.chroma else no_chroma
            raise FieldError("chroma", expected=expected, got=repr(self.chroma))
        if self.crf is not None and self.crf > choices.worst_crf:
            expected = f"1 to {choices.worst_crf} for {codec}" if choices.crf else no_crf
            raise FieldError("crf", expected=expected, got=self.crf)
        return self

    @property
    def suffix(self) -> str:
        """The suffix of the container."""
        return f".{self.container or CHOICES[self.codec].containers[0]}"


class ShownVideo(VideoOptions):
    """The base of videos for people, whose pictures have the size of views and are enlarged."""

    scale: int | None = Field(default=None, ge=1, le=64)
    """The pixels per lens; the default gives about 720 px for people, and is 1 for lossless codecs."""
    filter: Literal["bicubic"] | Filter = "bicubic"
    """The filter that enlarges pictures: `bicubic` works on sRGB codes and is fast; the others work in linear light."""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse pictures that are too large for players."""
        super().check(rig, frames)
        longest_px = self.longest_lenses(rig) * (self.scale or 1)
        if self.scale and longest_px > MAX_SHOWN_PX:
            raise FieldError("scale", expected=f"a picture of at most {MAX_SHOWN_PX} px a side", got=f"{longest_px} px")

    def longest_lenses(self, rig: Rig) -> int:
        """Return the number of lenses along the longer side of a picture."""
        return max(rig.lens_array.count)


@output_kind
class ViewsVideo(ShownVideo):
    """All views of every frame in succession; every second frame runs backward, so that nothing jumps."""

    kind: Literal["views"] = "views"
    name: Name = "views"
    views_per_s: Fps = 24.0
    """The views per second; a frame of 8 x 8 views takes 2.7 s by default."""


@output_kind
class CentreVideo(ShownVideo):
    """The centre view of every frame."""

    kind: Literal["centre"] = "centre"
    name: Name = "centre"
    repeat: Repeat = 1
    """The number of times that the sequence is shown."""


@output_kind
class OrthoscopicVideo(VideoOptions):
    """The orthoscopic integral video, pixel for pixel."""

    kind: Literal["orthoscopic"] = "orthoscopic"
    name: Name = "orthoscopic"
    codec: Codec = "ffv1"
    """The codec of the video; `ffv1` is lossless."""


@output_kind
class IntegralVideo(VideoOptions):
    """The integral video as captured, pseudoscopic, pixel for pixel."""

    kind: Literal["integral"] = "integral"
    name: Name = "integral"
    codec: Codec = "ffv1"
    """The codec of the video; `ffv1` is lossless."""


def _one_of(words: tuple[object, ...]) -> str:
    return " or ".join(map(str, words))
