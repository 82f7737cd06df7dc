"""The clock of a scene, and the other variables that POV-Ray gives the frames of an animation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

from pydantic import Field, model_validator

from lippmann.job.animation.frames import MAX_FRAME_NUMBER
from lippmann.job.fields.model import JobModel
from lippmann.job.fields.problems import FieldError

_CLOSE = 1e-9
"""The relative difference up to which two steps of the clock are equal."""


class Clock(JobModel):
    """The clock of POV-Ray at each frame: first + (frame - 1) * per_frame, from the start again after each repeat.

    `first`, `last`, `frames` and `cyclic` are the options Initial_Clock, Final_Clock, Final_Frame and Cyclic_Animation
    of POV-Ray.
    """

    first: float = 0.0
    """The clock at frame 1."""
    per_frame: float = 1.0
    """The increment from one frame to the next; with `last`, it follows from `last` and `frames`."""
    last: float | None = None
    """The clock at the last of `frames`; in a cyclic animation, that of the frame after it."""
    frames: int | None = Field(default=None, ge=1, le=MAX_FRAME_NUMBER)
    """The number of frames of the whole animation, of which a job may render some; null for the job's last frame."""
    cyclic: bool = False
    """True if the frame after the last one equals the first, so that the animation can repeat."""
    repeat_frames: int | None = Field(default=None, ge=1, le=MAX_FRAME_NUMBER)
    """The number of frames after which the clock starts again, for a motion that repeats; null if it never does."""

    @model_validator(mode="before")
    @classmethod
    def _fill_in_per_frame(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or "per_frame" in data or data.get("last") is None:
            return data
        first, last, frames = data.get("first", 0.0), data["last"], data.get("frames")
        if not (isinstance(first, int | float) and isinstance(last, int | float) and isinstance(frames, int)):
            return data
        steps = _steps(frames, cyclic=data.get("cyclic") is True)
        try:
            return {**data, "per_frame": (last - first) / steps} if steps > 0 else data
        except OverflowError:  # The fields themselves say what is expected.
            return data

    @model_validator(mode="after")
    def _check_last(self) -> Self:
        if self.last is None:
            if self.cyclic:
                raise FieldError("last", expected="the clock at which a cyclic animation is complete", got="none")
            return self
        steps = 0 if self.frames is None else _steps(self.frames, cyclic=self.cyclic)
        if steps < 1:
            raise FieldError("frames", expected="2 frames or more from first to last", got=self.frames)
        if abs(self.per_frame - (self.last - self.first) / steps) > _CLOSE * abs(self.per_frame):
            raise FieldError("per_frame", expected="per_frame, or last and frames", got="both, which differ")
        return self

    def at(self, frame: int) -> float:
        """Return the clock at a frame; frames are counted from 1.

        >>> Clock(repeat_frames=45).at(46)
        0.0
        >>> Clock(last=1.0, frames=5).at(5)
        1.0
        """
        return self.first + (self._number(frame) - 1) * self.per_frame

    def variables(self, frame: int) -> dict[str, float]:
        """Return the variables of an animation at a frame as POV-Ray 3.7 gives them to a scene, without the clock.

        >>> Clock(last=1.0, frames=5).variables(3)["frame_number"]
        3.0

        Notes
        -----
        In a cyclic animation POV-Ray counts one frame more, at which the clock is the final one.
        """
        frames = self.repeat_frames or self.frames or frame
        final = self.first + (frames - 1) * self.per_frame if self.last is None else self.last
        return {
            "frame_number": float(self._number(frame)),
            "initial_frame": 1.0,
            "final_frame": float(frames + self.cyclic),
            "initial_clock": self.first,
            "final_clock": final,
            "clock_delta": self.per_frame,
        }

    def _number(self, frame: int) -> int:
        return frame if self.repeat_frames is None else (frame - 1) % self.repeat_frames + 1


def _steps(frames: int, *, cyclic: bool) -> int:
    return frames if cyclic else frames - 1
