"""The camera of a scene, and the place of a rig that follows it."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from lippmann.job.fields.model import JobModel
from lippmann.job.scenes.stage import Stage, Vector

Handedness = Literal["left", "right"]

_Share = Annotated[float, Field(ge=-1e6, le=1e6)]
_Direction = tuple[_Share, _Share, _Share]


class SceneCamera(JobModel):
    """The camera of a scene at a frame, in scene units; the vectors are those of POV-Ray divided by |direction|."""

    location: Vector
    direction: _Direction
    right: _Direction
    """The width of the picture at distance 1; the picture's right side is in this direction."""
    up: _Direction
    """The height of the picture at distance 1."""

    @model_validator(mode="after")
    def _check_axes(self) -> Self:
        if not (_norm(_cross(self.up, self.direction)) > 0 and _norm(self.right) > 0):
            raise ValueError("direction and up that span a plane")
        return self

    @property
    def handedness(self) -> Handedness:
        """The handedness of the scene: `right` if the camera shows it mirror-imaged, as right-handed scenes need."""
        return "left" if _dot(_cross(self.up, self.direction), self.right) > 0 else "right"

    @property
    def angle_deg(self) -> float:
        """The horizontal angle of view, if the camera is a perspective camera."""
        return math.degrees(2 * math.atan(_norm(self.right) / 2 / _norm(self.direction)))

    def axes(self) -> tuple[Vector, Vector, Vector]:
        """Return the unit vectors right, up and ahead of a camera that is not mirror-imaged, in this place."""
        ahead = _unit(self.direction)
        right = _unit(_cross(self.up, ahead))
        return right, _cross(ahead, right), ahead

    def is_at(self, other: SceneCamera) -> bool:
        """Return whether another camera has the same place and the same directions, but for what a report errs."""
        near = 1e-5 * (1.0 + max(map(abs, (*self.location, *other.location))))
        same_place = math.dist(self.location, other.location) <= near
        pairs = zip(self.axes(), other.axes(), strict=True)
        return same_place and all(math.dist(mine, theirs) <= _SAME_DIRECTION for mine, theirs in pairs)


_SAME_DIRECTION = 1e-4
"""The distance up to which two unit vectors are equal; a report errs by 1e-5."""


def followed_stage(stage: Stage, *, first: SceneCamera, now: SceneCamera) -> Stage:
    """Return the stage of a rig that moves as the camera of the scene has moved.

    Parameters
    ----------
    stage
        The stage at frame 1 of the animation.
    first
        The camera at frame 1.
    now
        The camera at the frame.
    """
    turned = _Turn(first.axes(), now.axes())
    ahead = _minus(stage.look_at, stage.location)
    location = _plus(now.location, turned(_minus(stage.location, first.location)))
    return Stage.model_validate(
        {**stage.model_dump(), "location": location, "look_at": _plus(location, turned(ahead)), "up": turned(stage.up)}
    )


class _Turn:
    """The rotation from one set of axes to another."""

    def __init__(self, before: tuple[Vector, Vector, Vector], after: tuple[Vector, Vector, Vector]) -> None:
        self._before, self._after = before, after

    def __call__(self, vector: Vector) -> Vector:
        shares = [_dot(vector, axis) for axis in self._before]
        x, y, z = (sum(share * axis[i] for share, axis in zip(shares, self._after, strict=True)) for i in range(3))
        return x, y, z


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _norm(a: Vector) -> float:
    return math.sqrt(_dot(a, a))


def _unit(a: Vector) -> Vector:
    length = _norm(a)
    return a[0] / length, a[1] / length, a[2] / length


def _plus(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
