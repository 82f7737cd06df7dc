"""The job as it was asked for: scene, frames, rig, capture, render settings and outputs.

`parse_spec` is the one door: it takes the JSON of a job file and gives a `JobSpec`, or a `SpecError` that names every
field that is wrong, what was expected there and what came.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.frames import FrameList, parse_frames
from lippmann.job.keyframes import ANIMATED_PARTS, MAX_KEYS, Keyframes, lift, put
from lippmann.job.old_names import current_job
from lippmann.job.outputs.choice import DEFAULT_OUTPUTS, Output, check_names, check_options
from lippmann.job.problems import Misfit, problems_of
from lippmann.job.render_settings import Capture, RenderSettings
from lippmann.job.rig import MAX_FRAME_PX, Rig
from lippmann.job.stage import StageChange

ParameterValue = bool | int | float | str

STILL_FIELDS = ("rig.lens_array.count", "rig.px_per_lens", "rig.device")
"""Numbers that say how many pixels a frame has: the same for every frame."""

MAX_OUTPUTS = 100
"""Of one job: beyond it something writes job files that nobody reads."""

MAX_TRIED = 100
"""Frames, and keyframes between them, at which an animated job is tried when it arrives: a third of a second."""


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Display(_Part):
    """How the integral image is to be shown: what the designer reckons with."""

    gap_real_mm: float | None = Field(default=None, gt=0, le=10_000)
    """From the pixels to the lenses as built, substrate included, for images in front of the display."""
    gap_virtual_mm: float | None = Field(default=None, gt=0, le=10_000)
    """The same for images behind it."""
    viewing_distance_mm: float = Field(default=1000.0, gt=0, le=1e6)


class Clock(_Part):
    """How frame numbers become POV-Ray's clock: first + (frame - 1) * per_frame."""

    first: float = 0.0
    per_frame: float = 1.0

    def at(self, frame: int) -> float:
        """Return the clock of a frame; frames count from 1."""
        return self.first + (frame - 1) * self.per_frame


class JobSpec(_Part):
    """A job as it was asked for."""

    scene: str = Field(min_length=1, max_length=100, pattern=r"^[a-z0-9][a-z0-9-]*$")
    title: str = Field(default="", max_length=200)
    parameters: dict[str, ParameterValue] = Field(default_factory=dict)
    stage: StageChange = StageChange()
    clock: Clock | None = None
    """The scene's own clock when not given."""
    frames: FrameList = "1"
    fps: float = Field(default=8.0, gt=0, le=240)
    rig: Rig = Rig()
    capture: Capture = Capture()
    render: RenderSettings = RenderSettings()
    display: Display = Display()
    priority: int = Field(default=50, ge=0, le=100)
    """Higher goes first."""
    outputs: Annotated[tuple[Output, ...], Field(max_length=MAX_OUTPUTS)] = DEFAULT_OUTPUTS
    animation: dict[str, Keyframes] = Field(default_factory=dict)
    """Keyframes by the path of the number that they move, as `rig.lens_array.offset_mm`; it holds the first value."""

    @model_validator(mode="before")
    @classmethod
    def _lift_keyframes(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        constant, found = lift(data)
        given = constant.get("animation", {})
        return constant | {"animation": {**given, **found}} if found and isinstance(given, Mapping) else data

    @model_validator(mode="before")
    @classmethod
    def _rename_old_names(cls, data: Any) -> Any:
        return current_job(data)[0]

    @model_validator(mode="after")
    def _keyframes_are_meant(self) -> Self:
        if sum(len(keyframes.keyframes) for keyframes in self.animation.values()) > MAX_KEYS:
            raise Misfit("animation", expected=f"at most {MAX_KEYS} keyframes in all", got="more")
        data = self.model_dump(mode="json", include=set(ANIMATED_PARTS)) if self.animation else {}
        for path, keyframes in self.animation.items():
            first = keyframes.keyframes[0][1]
            try:
                written = put(data, path, first)
            except KeyError:
                continue  # `parse_spec` says so
            if written not in (None, first):
                raise Misfit(path, expected=f"the first of its keyframes, {first:g}, or none of them", got=written)
        return self

    @model_validator(mode="after")
    def _outputs_told_apart(self) -> Self:
        check_names(self.outputs)
        return self

    @model_validator(mode="after")
    def _outputs_fit(self) -> Self:
        self.check_outputs()
        return self

    def check_outputs(self) -> None:
        """Refuse outputs that do not go with the rig, the frames or the display.

        Raises
        ------
        Misfit
            Naming the option, by the output's place.
        """
        check_options(
            self.outputs,
            self.rig,
            self.frame_numbers,
            has_depth=self.capture.depth,
            viewing_distance_mm=self.display.viewing_distance_mm,
        )

    @model_validator(mode="after")
    def _fits_supersampled(self) -> Self:
        longest = max(self.rig.lens_array.count) * self.rig.px_per_lens * self.capture.supersample
        if longest > MAX_FRAME_PX:
            expected = f"count x px_per_lens x supersample of at most {MAX_FRAME_PX} px a side"
            raise Misfit("capture.supersample", expected=expected, got=f"{longest} px")
        return self

    @model_validator(mode="after")
    def _ray_camera_alone(self) -> Self:
        if self.capture.method == "ray_camera" and self.render.antialias != "off":
            expected = "off with capture.method ray_camera, which has one ray a pixel: capture.supersample is for it"
            raise Misfit("render.antialias", expected=expected, got="on")
        if self.capture.method == "ray_camera" and self.rig.dispersion:
            raise Misfit("rig.dispersion", expected="false with capture.method ray_camera, of one colour", got="true")
        return self

    @property
    def frame_numbers(self) -> tuple[int, ...]:
        """The frames asked for, rising."""
        return parse_frames(self.frames)

    def at(self, frame: int) -> JobSpec:
        """Return the job as it is at a frame: every keyframed number a constant.

        Raises
        ------
        SpecError
            If a number is out of bounds there.
        """
        if not self.animation:
            return self
        try:
            return self.moved({path: keyframes.at(frame) for path, keyframes in self.animation.items()})
        except ValidationError as error:
            raise SpecError.of(
                replace(problem, got=f"{problem.got} at frame {frame}") for problem in problems_of(error)
            ) from error

    def moved(self, values: Mapping[str, float]) -> JobSpec:
        """Return the job without keyframes, with other numbers at some paths.

        Raises
        ------
        KeyError
            If there is no such number.
        ValidationError
            If one is out of bounds.
        """
        data = self.model_dump(mode="json", include=set(ANIMATED_PARTS))
        for path, value in values.items():
            before = put(data, path, value)
            if isinstance(before, bool | str | list | dict):
                raise KeyError(path)
        there = _Moving.model_validate(data)
        update = {"rig": there.rig, "stage": there.stage, "parameters": there.parameters, "animation": {}}
        return self.model_copy(update=update)

    def tried_frames(self) -> tuple[int, ...]:
        """Return the frames at which a job is tried before it is taken: all, or of many those that tell most."""
        numbers = self.frame_numbers
        if not self.animation:
            return numbers[:1]
        keyed = {key for keyframes in self.animation.values() for key, _ in keyframes.keyframes}
        between = sorted(key for key in keyed if numbers[0] < key < numbers[-1])
        return tuple(sorted({*_spread(numbers), *_spread(between)}))


class _Moving(_Part):
    """What of a job may change with the frame."""

    rig: Rig
    stage: StageChange
    parameters: dict[str, ParameterValue]


def _spread(numbers: Sequence[int]) -> Sequence[int]:
    """Return at most `MAX_TRIED` of rising numbers, the first and the last among them."""
    last = len(numbers) - 1
    if last < MAX_TRIED:
        return numbers
    return [numbers[last * place // (MAX_TRIED - 1)] for place in range(MAX_TRIED)]


def parse_spec(data: Any) -> JobSpec:
    """Return the job that JSON data asks for.

    Raises
    ------
    SpecError
        With one `FieldProblem` for every field that is unknown, missing or out of bounds, at any keyframe.

    Warns
    -----
    FutureWarning
        For every old name in the job; see `lippmann.job.old_names`.
    """
    if not isinstance(data, Mapping):
        raise SpecError(f"expected a job as a JSON object, got {type(data).__name__}")
    for note in current_job(data)[1]:
        warnings.warn(note, FutureWarning, stacklevel=2)
    try:
        spec = JobSpec.model_validate(data)
    except ValidationError as error:
        raise SpecError.of(problems_of(error)) from error
    problems = [problem for path in spec.animation for problem in _problems_of_animation(spec, path)]
    if problems:
        raise SpecError.of(problems)
    return spec


def _problems_of_animation(spec: JobSpec, path: str) -> Iterator[FieldProblem]:
    """Yield what is wrong with keyframes; each key is tried alone, so that the message names it."""
    if not _may_move(spec, path):
        expected = f"a number of {', '.join(ANIMATED_PARTS)} that does not change how many pixels a frame has"
        yield FieldProblem(field=path, expected=expected, got="keyframes")
        return
    for frame, value in spec.animation[path].keyframes:
        try:
            spec.moved({path: value})
        except KeyError:
            yield FieldProblem(field=path, expected="a number that is there to change", got="keyframes")
            return
        except ValidationError as error:
            for problem in problems_of(error):
                yield FieldProblem(field=path, expected=problem.expected, got=f"{value:g} at frame {frame}")
            return


def _may_move(spec: JobSpec, path: str) -> bool:
    still = (*STILL_FIELDS, "rig.lens_array.pitch_mm") if spec.rig.device else STILL_FIELDS
    return path.partition(".")[0] in ANIMATED_PARTS and not any(
        path == field or path.startswith(f"{field}.") for field in still
    )
