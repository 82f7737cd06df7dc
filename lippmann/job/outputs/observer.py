"""The view of an observer of the display: as a clip, and as a picture of every frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from lippmann.job.fields.problems import FieldError
from lippmann.job.optics.rig import Rig
from lippmann.job.optics.viewing import (
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
from lippmann.job.outputs.clips import ClipOptions
from lippmann.job.outputs.output import Name, OutputOptions, output_kind
from lippmann.job.outputs.videos import VideoOptions

AsideMm = Annotated[float, Field(ge=-1e6, le=1e6)]


class ObserverOptions(OutputOptions):
    """The options of the observer and of the display."""

    x_mm: AsideMm = 0.0
    """The place of the eye, or of the middle between two eyes, to the right of the middle of the display."""
    y_mm: AsideMm = 0.0
    """The place above the middle of the display."""
    distance_mm: float | None = Field(default=None, gt=0, le=1e6)
    """The distance in front of the display; the default is `display.viewing_distance_mm`."""
    pupil_mm: float = Field(default=PUPIL_MM, gt=0, le=1000)
    """The diameter of the pupil of the eye."""
    focus_mm: float = Field(default=0.0, ge=-1e9, le=1e6)
    """The depth s of the display at which the eye is focused."""
    rays: int = Field(default=RAYS, ge=1, le=MAX_RAYS)
    """The number of rays through the pupil for every pixel."""
    stereo: Stereo | None = None
    """The arrangement of the pictures of two eyes; the default is one eye."""
    eye_distance_mm: float = Field(default=EYES_APART_MM, gt=0, le=10_000)
    """The distance between the eyes."""
    gap: GapUse = "collimated"
    """The gap between pixels and lenses: a focal length, or that of `display` or the designer for real or virtual
    images."""
    device: bool = False
    """True to use the pixels of `rig.device`; otherwise the cells as rendered."""
    bare: Bare = "clear"
    """The area between the lenses."""
    surround: Surround = "black"
    """The area beyond the pixels."""
    size_px: int = Field(default=SIZE_PX, ge=1, le=MAX_SIZE_PX)
    """The longer side of the picture of an eye."""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a device that the rig does not have, and a gap thinner than its substrate."""
        super().check(rig, frames)
        array = rig.lens_array
        if self.gap == "collimated" and array.focal_length_mm < array.substrate_mm / array.index:
            expected = "real or virtual: the substrate alone, by its index, is thicker than a focal length"
            raise FieldError("gap", expected=expected, got=repr(self.gap))
        if self.device and rig.device is None:
            raise FieldError("device", expected="false without rig.device", got="true")

    def check_viewing(self, rig: Rig, viewing_distance_mm: float) -> None:
        """Refuse a focus behind the eye."""
        super().check_viewing(rig, viewing_distance_mm)
        distance_mm = self.distance_mm or viewing_distance_mm
        if self.focus_mm >= distance_mm:
            expected = f"a depth nearer to the display than the eye, less than {distance_mm:g} mm"
            raise FieldError("focus_mm", expected=expected, got=f"{self.focus_mm:g} mm")


@output_kind
class ObserverVideo(ObserverOptions, ClipOptions, VideoOptions):
    """A video of an eye that moves in front of the display while the frames play."""

    kind: Literal["observer"] = "observer"
    name: Name = "observer"
    rays: int = Field(default=MOVING_RAYS, ge=1, le=MAX_RAYS)
    path: EyePath = "horizontal"
    """The path of the eye around its place."""
    reach_mm: float = Field(default=REACH_MM, ge=-1e6, le=1e6)
    """The amplitude of the path."""

    def check_viewing(self, rig: Rig, viewing_distance_mm: float) -> None:
        """Refuse an eye that would reach the display."""
        super().check_viewing(rig, viewing_distance_mm)
        if self.path == "toward":
            nearest_mm = (self.distance_mm or viewing_distance_mm) - max(0.0, self.reach_mm)
            if nearest_mm <= max(0.0, self.focus_mm):
                expected = "less than the eye's distance from the display and from what it focuses on"
                raise FieldError("reach_mm", expected=expected, got=f"{self.reach_mm:g} mm")


@output_kind
class ObserverPictures(ObserverOptions):
    """The view of an observer of every frame from one place, as PNG."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {".png": {}}

    kind: Literal["observer_pictures"] = "observer_pictures"
    name: Name = "observer_pictures"
    bits: Literal[8, 16] = 8
    """The bits of each colour channel."""

    @property
    def suffix(self) -> str:
        """The suffix of PNG files."""
        return ".png"
