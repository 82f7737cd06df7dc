"""The job specification: scene, frames, rig, capture, render settings and outputs.

`parse_spec` validates the JSON of a job file and returns a `JobSpec`; every other module receives jobs from it. Its
`SpecError` names every invalid field, the expected value and the value received.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, Self

from pydantic import (
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.animation.clock import Clock
from lippmann.job.animation.frames import FrameList, parse_frames
from lippmann.job.animation.keyframes import ANIMATED_PARTS, MAX_KEYS, Keyframes, lift, put
from lippmann.job.fields.model import JobModel
from lippmann.job.fields.old_names import current_job
from lippmann.job.fields.problems import FieldError, problems_of
from lippmann.job.optics.rig import MAX_FRAME_PX, Rig
from lippmann.job.outputs.choice import DEFAULT_OUTPUTS, Output, check_names, check_options
from lippmann.job.rendering.render_settings import Capture, RenderSettings
from lippmann.job.rendering.workers import WorkerRequirement
from lippmann.job.scenes.stage import StageChange
from lippmann.untrusted.shown import shown

ParameterValue = bool | int | float | str

CONSTANT_FIELDS = ("rig.lens_array.count", "rig.px_per_lens", "rig.device")
"""The fields that determine the number of pixels of a frame, which is the same for every frame."""

MAX_OUTPUTS = 100
"""The greatest number of outputs of a job."""

MAX_JOB_SLOTS = 100_000
"""The greatest limit of slots of a job."""

MAX_PARAMETERS = 1000
"""The greatest number of parameters of a scene."""

MAX_CHECKED_FRAMES = 100
"""The greatest number of frames, and of keyframes between them, at which an animated job is validated; this takes a
third of a second."""


class Display(JobModel):
    """The display of the integral image, for which the designer computes."""

    gap_real_mm: float | None = Field(default=None, gt=0, le=10_000)
    """The physical gap between pixels and lenses, substrate included, for images in front of the display."""
    gap_virtual_mm: float | None = Field(default=None, gt=0, le=10_000)
    """The physical gap between pixels and lenses, substrate included, for images behind the display."""
    viewing_distance_mm: float = Field(default=1000.0, gt=0, le=1e6)
    """The distance of the observer from the display."""


class JobSpec(JobModel):
    """The specification of a job."""

    scene: str = Field(min_length=1, max_length=100, pattern=r"^[a-z0-9][a-z0-9-]*$")
    """The name of the scene."""
    title: str = Field(default="", max_length=200)
    """The title of the job."""
    parameters: dict[str, ParameterValue] = Field(default_factory=dict, max_length=MAX_PARAMETERS)
    """The values of scene parameters, by name."""
    stage: StageChange = StageChange()
    """The changes to the stage of the scene."""
    clock: Clock | None = None
    """The clock of POV-Ray; null for the clock of the scene."""
    frames: FrameList = "1"
    """The frame numbers, as in `1-48:2, 60`."""
    fps: float = Field(default=8.0, gt=0, le=240)
    """The frames per second of videos."""
    rig: Rig = Rig()
    """The rig that captures the scene."""
    capture: Capture = Capture()
    """The capture method and its samples."""
    render: RenderSettings = RenderSettings()
    """The engine and its settings, and the limits of an attempt."""
    display: Display = Display()
    """The display that shows the integral image."""
    priority: int = Field(default=50, ge=0, le=100)
    """The priority of the job; jobs with a higher priority are scheduled first."""
    slots: int | None = Field(default=None, ge=1, le=MAX_JOB_SLOTS)
    """The greatest number of tasks of the job that run at the same time; null for no limit of its own."""
    workers: WorkerRequirement = WorkerRequirement()
    """The workers that may do the tasks of the job."""
    outputs: Annotated[tuple[Output, ...], Field(max_length=MAX_OUTPUTS)] = DEFAULT_OUTPUTS
    """The outputs of the job."""
    animation: dict[str, Keyframes] = Field(default_factory=dict)
    """The keyframes of each animated number by its path, as `rig.lens_array.offset_mm`. The number itself has the value
    of the first keyframe."""

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

    @field_validator("outputs", "parameters", mode="before")
    @classmethod
    def _check_count(cls, items: Any, info: ValidationInfo) -> Any:
        # `max_length` would count the items only after it has validated them.
        most = MAX_OUTPUTS if info.field_name == "outputs" else MAX_PARAMETERS
        if isinstance(items, list | tuple | dict) and len(items) > most:
            raise ValueError(f"at most {most} {info.field_name}, got {len(items)}")
        return items

    @model_validator(mode="after")
    def _check_keyframes(self) -> Self:
        if sum(len(keyframes.keyframes) for keyframes in self.animation.values()) > MAX_KEYS:
            raise FieldError("animation", expected=f"at most {MAX_KEYS} keyframes in all", got="more")
        data = self.model_dump(mode="json", include=set(ANIMATED_PARTS)) if self.animation else {}
        for path, keyframes in self.animation.items():
            first = keyframes.keyframes[0][1]
            try:
                written = put(data, path, first)
            except KeyError:
                continue  # `parse_spec` reports it.
            if written not in (None, first):
                raise FieldError(path, expected=f"the first of its keyframes, {first:g}, or none of them", got=written)
        return self

    @model_validator(mode="after")
    def _check_output_names(self) -> Self:
        check_names(self.outputs)
        return self

    @model_validator(mode="after")
    def _check_outputs(self) -> Self:
        self.check_outputs()
        return self

    def check_outputs(self) -> None:
        """Refuse outputs that are incompatible with the rig, the frames or the display.

        Raises
        ------
        FieldError
            The error names the option, by the index of the output.
        """
        check_options(
            self.outputs,
            self.rig,
            self.frame_numbers,
            has_depth=self.capture.depth,
            viewing_distance_mm=self.display.viewing_distance_mm,
        )

    @model_validator(mode="after")
    def _check_supersampled_size(self) -> Self:
        longest = max(self.rig.lens_array.count) * self.rig.px_per_lens * self.capture.supersample
        if longest > MAX_FRAME_PX:
            expected = f"count x px_per_lens x supersample of at most {MAX_FRAME_PX} px a side"
            raise FieldError("capture.supersample", expected=expected, got=f"{longest} px")
        return self

    @model_validator(mode="after")
    def _check_ray_camera(self) -> Self:
        if self.capture.method == "ray_camera" and self.render.antialias != "off":
            expected = "off with capture.method ray_camera, which has one ray a pixel: capture.supersample is for it"
            raise FieldError("render.antialias", expected=expected, got="on")
        return self

    @property
    def rays_per_px(self) -> int:
        """The greatest number of camera rays of a pixel of the sheet: its finer pixels, times its wavelength bands."""
        by_rays = self.capture.method != "glass" and self.render.antialias == "off"
        return self.capture.supersample**2 * (self.capture.bands if by_rays and self.rig.dispersion else 1)

    @property
    def frame_numbers(self) -> tuple[int, ...]:
        """The frame numbers in ascending order."""
        return parse_frames(self.frames)

    def at(self, frame: int) -> JobSpec:
        """Return the job at a frame: every animated number has its value at that frame.

        Raises
        ------
        SpecError
            If a number is out of bounds at that frame.
        """
        if not self.animation:
            return self
        try:
            return self.with_values({path: keyframes.at(frame) for path, keyframes in self.animation.items()})
        except ValidationError as error:
            raise SpecError.of(
                replace(problem, got=f"{problem.got} at frame {frame}") for problem in problems_of(error)
            ) from error

    def with_values(self, values: Mapping[str, float]) -> JobSpec:
        """Return the job without keyframes, with new values at some paths.

        Raises
        ------
        KeyError
            If a path names no number.
        ValidationError
            If a value is out of bounds.
        """
        data = self.model_dump(mode="json", include=set(ANIMATED_PARTS))
        for path, value in values.items():
            before = put(data, path, value)
            if isinstance(before, bool | str | list | dict):
                raise KeyError(path)
        parts = _AnimatedParts.model_validate(data)
        update = {"rig": parts.rig, "stage": parts.stage, "parameters": parts.parameters, "animation": {}}
        return self.model_copy(update=update)

    def checked_frames(self) -> tuple[int, ...]:
        """Return the frames at which a job is validated: all frames, or a selection of frames and keyframes."""
        numbers = self.frame_numbers
        if not self.animation:
            return numbers[:1]
        keyed = {key for keyframes in self.animation.values() for key, _ in keyframes.keyframes}
        between = sorted(key for key in keyed if numbers[0] < key < numbers[-1])
        return tuple(sorted({*_selection(numbers), *_selection(between)}))


class _AnimatedParts(JobModel):
    """The parts of a job that may change from frame to frame."""

    rig: Rig
    stage: StageChange
    parameters: dict[str, ParameterValue]


def _selection(numbers: Sequence[int]) -> Sequence[int]:
    """Return at most `MAX_CHECKED_FRAMES` of ascending numbers, evenly spaced, with the first and the last."""
    last = len(numbers) - 1
    if last < MAX_CHECKED_FRAMES:
        return numbers
    return [numbers[last * place // (MAX_CHECKED_FRAMES - 1)] for place in range(MAX_CHECKED_FRAMES)]


def parse_spec(data: Any) -> JobSpec:
    """Validate the JSON data of a job.

    Raises
    ------
    SpecError
        The error has one `FieldProblem` for every field that is unknown, missing or out of bounds, at any keyframe.

    Warns
    -----
    FutureWarning
        The job has an old name, one warning for each; see `lippmann.job.fields.old_names`.
    """
    if not isinstance(data, Mapping):
        raise SpecError(f"expected a job as a JSON object, got {shown(data)}")
    for note in current_job(data)[1]:
        warnings.warn(note, FutureWarning, stacklevel=2)
    try:
        spec = JobSpec.model_validate(data)
    except ValidationError as error:
        raise SpecError.of(problems_of(error, JobSpec)) from error
    problems = [problem for path in spec.animation for problem in _problems_of_animation(spec, path)]
    if problems:
        raise SpecError.of(problems)
    return spec


def _problems_of_animation(spec: JobSpec, path: str) -> Iterator[FieldProblem]:
    """Yield the problems of an animation; each keyframe is validated alone, so that the message names it."""
    if not _may_change(spec, path):
        expected = f"a number of {', '.join(ANIMATED_PARTS)} that does not change how many pixels a frame has"
        yield FieldProblem(field=path, expected=expected, got="keyframes")
        return
    for frame, value in spec.animation[path].keyframes:
        try:
            spec.with_values({path: value})
        except KeyError:
            yield FieldProblem(field=path, expected="a number that is there to change", got="keyframes")
            return
        except ValidationError as error:
            for problem in problems_of(error):
                yield FieldProblem(field=path, expected=problem.expected, got=f"{value:g} at frame {frame}")
            return


def _may_change(spec: JobSpec, path: str) -> bool:
    constant = (*CONSTANT_FIELDS, "rig.lens_array.pitch_mm") if spec.rig.device else CONSTANT_FIELDS
    return path.partition(".")[0] in ANIMATED_PARTS and not any(
        path == field or path.startswith(f"{field}.") for field in constant
    )
