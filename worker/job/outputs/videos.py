"""Moving pictures: one file for the whole job."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field

from worker.job.outputs.output import Name, OutputOptions

Codec = Literal["h264", "ffv1"]
"""`h264` for people, `ffv1` without loss."""

_SUFFIXES: Mapping[str, str] = {"h264": ".mp4", "ffv1": ".mkv"}


class VideoOptions(OutputOptions):
    """What all videos have."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {".mp4": {"codec": "h264"}, ".mkv": {"codec": "ffv1"}}
    IS_VIDEO: ClassVar[bool] = True

    codec: Codec = "h264"

    @property
    def suffix(self) -> str:
        """Of the container that the codec is put in."""
        return _SUFFIXES[self.codec]


class ViewsVideo(VideoOptions):
    """Every view of every frame, one after the other; every second frame backward, so that nothing jumps."""

    kind: Literal["views"] = "views"
    name: Name = "views"
    views_per_s: float = Field(default=24.0, gt=0, le=240)
    """A frame of 8 x 8 views takes 2.7 s."""


class CentreVideo(VideoOptions):
    """The centre view in time."""

    kind: Literal["centre"] = "centre"
    name: Name = "centre"


class OrthoscopicVideo(VideoOptions):
    """The integral video itself, pixel for pixel."""

    kind: Literal["orthoscopic"] = "orthoscopic"
    name: Name = "orthoscopic"
    codec: Codec = "ffv1"
