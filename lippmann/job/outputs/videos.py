"""Moving pictures: one file for the whole job."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from lippmann.job.outputs.codecs import CHOICES, Bits, Chroma, Codec, Container
from lippmann.job.outputs.output import Name, OutputOptions, output_kind
from lippmann.job.problems import Misfit
from lippmann.job.rig import Rig
from lippmann.job.viewing import Filter

MAX_SHOWN_PX = 8192
"""The longest side of a video for people: what players and graphics cards decode."""

Fps = Annotated[float, Field(gt=0, le=240)]
Repeat = Annotated[int, Field(ge=1, le=1000)]
"""How often the sequence is shown."""


class VideoOptions(OutputOptions):
    """What all videos have."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        ".mp4": {"codec": "h264"},
        ".webm": {"codec": "vp9"},
        ".mkv": {"codec": "ffv1"},
    }
    IS_VIDEO: ClassVar[bool] = True

    codec: Codec = "h264"
    container: Container | None = None
    """The codec's first when not given."""
    crf: int | None = Field(default=None, ge=1)
    """The encoder's own constant rate factor: 1 is the best."""
    chroma: Chroma | None = None
    bits: Bits = 8

    @model_validator(mode="after")
    def _codec_can(self) -> Self:
        choices, codec = CHOICES[self.codec], self.codec
        no_chroma, no_crf = f"none for {codec}, which keeps RGB", f"none for {codec}, which loses nothing"
        if self.container not in (None, *choices.containers):
            raise Misfit("container", expected=f"{_one_of(choices.containers)} for {codec}", got=repr(self.container))
        if self.bits not in choices.bits:
            raise Misfit("bits", expected=f"{_one_of(choices.bits)} for {codec}", got=self.bits)
        if self.chroma not in (None, *choices.chroma):
            expected = f"{_one_of(choices.chroma)} for {codec}" if choices.chroma else no_chroma
            raise Misfit("chroma", expected=expected, got=repr(self.chroma))
        if self.crf is not None and self.crf > choices.worst_crf:
            expected = f"1 to {choices.worst_crf} for {codec}" if choices.crf else no_crf
            raise Misfit("crf", expected=expected, got=self.crf)
        return self

    @property
    def suffix(self) -> str:
        """Of the container that the codec is put in."""
        return f".{self.container or CHOICES[self.codec].containers[0]}"


class ShownVideo(VideoOptions):
    """What videos of pictures have that are as small as views."""

    scale: int | None = Field(default=None, ge=1, le=64)
    """How many times larger than a pixel a lens; when not given about 720 px for people, 1 without loss."""
    filter: Literal["bicubic"] | Filter = "bicubic"
    """By which pictures are enlarged: `bicubic` on codes, and quick; the others in linear light."""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse pictures larger than players show."""
        super().check(rig, frames)
        longest_px = self.longest_lenses(rig) * (self.scale or 1)
        if self.scale and longest_px > MAX_SHOWN_PX:
            raise Misfit("scale", expected=f"a picture of at most {MAX_SHOWN_PX} px a side", got=f"{longest_px} px")

    def longest_lenses(self, rig: Rig) -> int:
        """Return how many lenses the longer side of a picture shows."""
        return max(rig.lens_array.count)


@output_kind
class ViewsVideo(ShownVideo):
    """Every view of every frame, one after the other; every second frame backward, so that nothing jumps."""

    kind: Literal["views"] = "views"
    name: Name = "views"
    views_per_s: Fps = 24.0
    """A frame of 8 x 8 views takes 2.7 s."""


@output_kind
class CentreVideo(ShownVideo):
    """The centre view in time."""

    kind: Literal["centre"] = "centre"
    name: Name = "centre"
    repeat: Repeat = 1


@output_kind
class OrthoscopicVideo(VideoOptions):
    """The integral video itself, pixel for pixel."""

    kind: Literal["orthoscopic"] = "orthoscopic"
    name: Name = "orthoscopic"
    codec: Codec = "ffv1"


@output_kind
class IntegralVideo(VideoOptions):
    """The integral video as it was captured, pseudoscopic, pixel for pixel."""

    kind: Literal["integral"] = "integral"
    name: Name = "integral"
    codec: Codec = "ffv1"


def _one_of(words: tuple[object, ...]) -> str:
    return " or ".join(map(str, words))
