"""The stage of a scene: the position of the rig and the scale, and the changes that a job makes."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal, Self

from pydantic import Field, ValidationError, model_validator

from lippmann.errors import SpecError
from lippmann.job.fields.model import JobModel
from lippmann.job.fields.problems import problems_of

MAX_MM = 1e9
"""The greatest length, a thousand kilometres; a greater one is an error of units."""

Mm = Annotated[float, Field(gt=0, le=MAX_MM)]
Vector = tuple[
    Annotated[float, Field(ge=-MAX_MM, le=MAX_MM, title="x")],
    Annotated[float, Field(ge=-MAX_MM, le=MAX_MM, title="y")],
    Annotated[float, Field(ge=-MAX_MM, le=MAX_MM, title="z")],
]
MmPerUnit = Annotated[float, Field(ge=1e-4, le=1e5)]
"""The scale of a scene, whose unit is between a tenth of a micrometre and a hundred metres; outside this range the rays
lose precision (measured)."""


class Stage(JobModel):
    """The position of the rig in the scene, in scene units, and the scale."""

    location: Vector
    """The position of the vertex of surface 1 of the imaging lens."""
    look_at: Vector
    """The point that the optical axis passes through."""
    up: Vector = (0.0, 1.0, 0.0)
    """The direction that is upward in the picture."""
    mm_per_unit: MmPerUnit = 1.0
    """The number of millimetres of the rig in one scene unit."""
    near_mm: Mm
    """The distance from surface 1 to the near plane, the nearest point that should be sharp."""
    far_mm: Mm
    """The distance from surface 1 to the far plane, the farthest point that should be sharp."""
    reference_mm: Mm = Field(default_factory=lambda given: given["near_mm"])
    """The distance from surface 1 to the reference plane of the scene; by default `near_mm`."""
    handedness: Literal["auto", "left", "right"] = "auto"
    """The handedness of the scene's axes: `right` mirrors the rig, so that text is readable; `auto` takes that of the
    scene's own camera."""
    follow_camera: bool = False
    """True if the rig moves from frame to frame as the scene's own camera does; the stage is that of frame 1 then."""

    @model_validator(mode="after")
    def _check_directions(self) -> Self:
        if self.far_mm < self.near_mm:
            raise ValueError(f"near_mm <= far_mm, got {self.near_mm} and {self.far_mm}")
        look = [b - a for a, b in zip(self.location, self.look_at, strict=True)]
        up = self.up
        cross = (
            look[1] * up[2] - look[2] * up[1],
            look[2] * up[0] - look[0] * up[2],
            look[0] * up[1] - look[1] * up[0],
        )
        if sum(c * c for c in cross) <= 1e-18 * sum(c * c for c in look) * sum(c * c for c in up):
            raise ValueError("location, look_at and up that span a plane")
        return self


class StageChange(JobModel):
    """The changes of a job to the stage of its scene; an absent field keeps the value of the scene."""

    location: Vector | None = None
    """The position of the vertex of surface 1 of the imaging lens."""
    look_at: Vector | None = None
    """The point that the optical axis passes through."""
    up: Vector | None = None
    """The direction that is upward in the picture."""
    mm_per_unit: MmPerUnit | None = None
    """The number of millimetres of the rig in one scene unit."""
    reference_mm: Mm | None = None
    """The distance from surface 1 to the reference plane of the scene."""
    near_mm: Mm | None = None
    """The distance from surface 1 to the near plane."""
    far_mm: Mm | None = None
    """The distance from surface 1 to the far plane."""
    handedness: Literal["left", "right"] | None = None
    """The handedness of the scene's axes."""
    follow_camera: bool | None = None
    """True if the rig moves from frame to frame as the scene's own camera does."""


def changed_stage(stage: Stage, change: StageChange) -> Stage:
    """Return the stage of a scene with the changes of a job.

    Raises
    ------
    SpecError
        If the result is invalid: the near plane is beyond the far plane, or the directions span no plane.
    """
    try:
        return Stage.model_validate(stage.model_dump() | change.model_dump(exclude_none=True))
    except ValidationError as error:
        raise SpecError.of(
            replace(problem, field=f"stage.{problem.field}".removesuffix(".(whole)")) for problem in problems_of(error)
        ) from error
