"""Where the rig stands in a scene, and the scale: as the scene says, and what a job says otherwise."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from lippmann.errors import SpecError
from lippmann.job.problems import problems_of

MAX_MM = 1e9
"""A thousand kilometres: more is a slip of units."""

Mm = Annotated[float, Field(gt=0, le=MAX_MM)]
Coordinate = Annotated[float, Field(ge=-MAX_MM, le=MAX_MM)]
Vector = tuple[Coordinate, Coordinate, Coordinate]
MmPerUnit = Annotated[float, Field(ge=1e-4, le=1e5)]
"""From scenes in tenths of a micrometre to scenes in hundreds of metres; beyond, rays lose digits (measured)."""


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Stage(_Part):
    """Where the rig stands in the scene (scene units) and the scale."""

    location: Vector
    """The vertex of surface 1 of the imaging lens."""
    look_at: Vector
    up: Vector = (0.0, 1.0, 0.0)
    mm_per_unit: MmPerUnit = 1.0
    """Millimetres of the rig in one unit of the scene."""
    near_mm: Mm
    """From surface 1 to the nearest thing that should come out sharp."""
    far_mm: Mm
    reference_mm: Mm = Field(default_factory=lambda given: given["near_mm"])
    """From surface 1 to the scene's reference plane; near_mm when not given."""

    @model_validator(mode="after")
    def _spans_a_frame(self) -> Self:
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


class StageChange(_Part):
    """What a job says otherwise about the scene's stage; see `Stage`."""

    location: Vector | None = None
    look_at: Vector | None = None
    up: Vector | None = None
    mm_per_unit: MmPerUnit | None = None
    reference_mm: Mm | None = None
    near_mm: Mm | None = None
    far_mm: Mm | None = None


def changed_stage(stage: Stage, change: StageChange) -> Stage:
    """Return a scene's stage with what a job says otherwise.

    Raises
    ------
    SpecError
        If the two do not go together: near beyond far, no way up.
    """
    try:
        return Stage.model_validate(stage.model_dump() | change.model_dump(exclude_none=True))
    except ValidationError as error:
        raise SpecError.of(
            replace(problem, field=f"stage.{problem.field}".removesuffix(".(whole)")) for problem in problems_of(error)
        ) from error
