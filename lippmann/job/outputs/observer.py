"""What an observer of the display sees: a clip, and pictures of every frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from lippmann.job.outputs.clips import ClipOptions
from lippmann.job.outputs.output import Name, OutputOptions, output_kind
from lippmann.job.outputs.videos import VideoOptions
from lippmann.job.problems import Misfit
from lippmann.job.rig import Rig
from lippmann.job.viewing import (
    EYES_APART_MM,
    MAX_RAYS,
    MAX_SIZE_PX,
    MOVING_RAYS,
    PUPIL_MM,
    RAYS,
    REACH_MM,
    SIZE_PX,
    Bare,
    EyePath,
    GapUse,
    Stereo,
    Surround,
)

AsideMm = Annotated[float, Field(ge=-1e6, le=1e6)]


class ObserverOptions(OutputOptions):
    """Where the observer is, how he looks, and what the display is like."""

    x_mm: AsideMm = 0.0
    """Of the eye, or of the middle between two, to the right of the display's middle."""
    y_mm: AsideMm = 0.0
    """Upward."""
    distance_mm: float | None = Field(default=None, gt=0, le=1e6)
    """In front; `display.viewing_distance_mm` when not given."""
    pupil_mm: float = Field(default=PUPIL_MM, gt=0, le=1000)
    focus_mm: float = Field(default=0.0, ge=-1e9, le=1e6)
    """The depth that is sharp, s of the display."""
    rays: int = Field(default=RAYS, ge=1, le=MAX_RAYS)
    """Through the pupil, for every pixel."""
    stereo: Stereo | None = None
    """How two eyes' pictures come together; one eye when not given."""
    eye_distance_mm: float = Field(default=EYES_APART_MM, gt=0, le=10_000)
    """From eye to eye."""
    gap: GapUse = "collimated"
    """Of pixels and lenses: a focal length, or as `display` says or the designer chooses for real or virtual images."""
    device: bool = False
    """On the pixels of `rig.device`; else on the cells as rendered."""
    bare: Bare = "clear"
    """What is there where no lens is."""
    surround: Surround = "black"
    """What is there beyond the pixels."""
    size_px: int = Field(default=SIZE_PX, ge=1, le=MAX_SIZE_PX)
    """Longer side of an eye's picture."""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a device where there is none, and a gap thinner than its glass."""
        super().check(rig, frames)
        array = rig.lens_array
        if self.gap == "collimated" and array.focal_length_mm < array.substrate_mm / array.index:
            expected = "real or virtual: the substrate alone, by its index, is thicker than a focal length"
            raise Misfit("gap", expected=expected, got=repr(self.gap))
        if self.device and rig.device is None:
            raise Misfit("device", expected="false without rig.device", got="true")

    def check_viewing(self, rig: Rig, viewing_distance_mm: float) -> None:
        """Refuse a focus behind the eye."""
        super().check_viewing(rig, viewing_distance_mm)
        distance_mm = self.distance_mm or viewing_distance_mm
        if self.focus_mm >= distance_mm:
            expected = f"a depth nearer to the display than the eye, less than {distance_mm:g} mm"
            raise Misfit("focus_mm", expected=expected, got=f"{self.focus_mm:g} mm")


@output_kind
class ObserverVideo(ObserverOptions, ClipOptions, VideoOptions):
    """A clip of an eye that moves before the display while time runs."""

    kind: Literal["observer"] = "observer"
    name: Name = "observer"
    rays: int = Field(default=MOVING_RAYS, ge=1, le=MAX_RAYS)
    path: EyePath = "horizontal"
    """Of the eye, about its place."""
    reach_mm: float = Field(default=REACH_MM, ge=-1e6, le=1e6)
    """How far it gets from there."""

    def check_viewing(self, rig: Rig, viewing_distance_mm: float) -> None:
        """Refuse an eye that would come to the display."""
        super().check_viewing(rig, viewing_distance_mm)
        if self.path == "toward":
            nearest_mm = (self.distance_mm or viewing_distance_mm) - max(0.0, self.reach_mm)
            if nearest_mm <= max(0.0, self.focus_mm):
                expected = "less than the eye's distance from the display and from what it focuses on"
                raise Misfit("reach_mm", expected=expected, got=f"{self.reach_mm:g} mm")


@output_kind
class ObserverPictures(ObserverOptions):
    """What is seen of every frame from one place, as PNG."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {".png": {}}

    kind: Literal["observer_pictures"] = "observer_pictures"
    name: Name = "observer_pictures"
    bits: Literal[8, 16] = 8

    @property
    def suffix(self) -> str:
        """PNG."""
        return ".png"
