"""The job as it was asked for: scene, frames, rig, capture, render settings and outputs.

`parse_spec` is the one door: it takes the JSON of a job file and gives a `JobSpec`, or a `SpecError` that names every
field that is wrong, what was expected there and what came.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    Tag,
    ValidationError,
    field_validator,
    model_validator,
)

from worker.errors import FieldProblem, SpecError
from worker.job.frames import parse_frames
from worker.job.keyframes import ANIMATED_PARTS, Keyframes, lift, put
from worker.job.rig import MAX_FRAME_PX, Rig
from worker.job.tagged import told_by, untagged

ParameterValue = bool | int | float | str

Output = Literal["views.mp4", "centre.mp4", "orthoscopic.mkv"]

OUTPUTS: tuple[Output, ...] = get_args(Output)
"""The videos that a job can ask for."""

STILL_FIELDS = ("rig.lens_array.count", "rig.px_per_lens", "rig.device")
"""Numbers that say how many pixels a frame has: the same for every frame."""


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Capture(_Part):
    """How the rays of the camera find their way through the optics."""

    method: Literal["auto", "raytraced", "ray_camera"] = "auto"
    """`raytraced`: POV-Ray refracts them in modelled glass. `ray_camera`: they come from the exact trace."""
    supersample: int = Field(default=1, ge=1, le=8)
    """Rendered pixels in each direction that are averaged to one, inside their cell and in linear light."""


class Antialias(_Part):
    """POV-Ray's antialiasing over the whole image; it blurs the borders of the cells."""

    threshold: float = Field(default=0.3, gt=0, lt=1)
    """Neighbours that differ by more are sampled again; POV-Ray 3.7 takes 1 for none."""
    method: Literal[1, 2] = 2
    """1: not recursive, never tiled. 2: adaptive and recursive."""
    depth: int = Field(default=3, ge=1, le=9)


AntialiasChoice = Annotated[
    Annotated[Literal["off"], Tag("(off)")] | Annotated[Antialias, Tag("(on)")],
    told_by(lambda value: "on" if isinstance(value, Mapping) else "off"),
]


class RenderSettings(_Part):
    """How POV-Ray renders, and when an attempt is given up."""

    antialias: AntialiasChoice = "off"
    tiles: Literal["auto"] | tuple[Annotated[int, Field(ge=1, le=64)], Annotated[int, Field(ge=1, le=64)]] = "auto"
    """Tiles of a frame as (tile_rows, tile_cols), or cut by the measured cost."""
    timeout_s: float = Field(default=6 * 3600.0, ge=1, le=7 * 86_400)
    """An attempt that runs longer is ended."""
    stall_s: float = Field(default=600.0, ge=1, le=86_400)
    """An attempt without progress for longer is ended."""
    memory_mb: int = Field(default=8192, ge=128, le=1_048_576)
    """Address space that one POV-Ray process may take."""

    @model_validator(mode="after")
    def _method_1_whole(self) -> Self:
        if not self.may_be_tiled and self.tiles not in ("auto", (1, 1)):
            raise ValueError(f"tiles auto or [1, 1] with antialias method 1, which leaves seams, got {self.tiles}")
        return self

    @property
    def may_be_tiled(self) -> bool:
        """Whether tiles put together are the whole, pixel for pixel: not under method 1 (measured)."""
        return self.antialias == "off" or self.antialias.method == 2


class Display(_Part):
    """How the integral image is to be shown: what the designer reckons with."""

    gap_real_mm: float | None = Field(default=None, gt=0, le=10_000)
    """From the pixels to the lenses as built, substrate included, for images in front of the display."""
    gap_virtual_mm: float | None = Field(default=None, gt=0, le=10_000)
    """The same for images behind it."""
    viewing_distance_mm: float = Field(default=1000.0, gt=0, le=1e6)


class StageChange(_Part):
    """What a job says otherwise about the scene's stage; see `worker.job.scene.Stage`."""

    location: tuple[float, float, float] | None = None
    look_at: tuple[float, float, float] | None = None
    up: tuple[float, float, float] | None = None
    mm_per_unit: float | None = Field(default=None, gt=0)
    reference_mm: float | None = Field(default=None, gt=0)
    near_mm: float | None = Field(default=None, gt=0)
    far_mm: float | None = Field(default=None, gt=0)


class Clock(_Part):
    """How frame numbers become POV-Ray's clock: first + (frame - 1) * per_frame."""

    first: float = 0.0
    per_frame: float = 1.0

    def at(self, frame: int) -> float:
        """Return the clock of a frame; frames count from 1."""
        return self.first + (frame - 1) * self.per_frame


def _check_frames(text: str) -> str:
    try:
        parse_frames(text)
    except SpecError as error:
        raise ValueError(error.message.removeprefix("expected ").partition(", got ")[0]) from error
    return text


class JobSpec(_Part):
    """A job as it was asked for."""

    scene: str = Field(min_length=1, max_length=100, pattern=r"^[a-z0-9][a-z0-9-]*$")
    title: str = Field(default="", max_length=200)
    parameters: dict[str, ParameterValue] = Field(default_factory=dict)
    stage: StageChange = StageChange()
    clock: Clock | None = None
    """The scene's own clock when not given."""
    frames: Annotated[str, Field(max_length=1000), AfterValidator(_check_frames)] = "1"
    fps: float = Field(default=8.0, gt=0, le=240)
    rig: Rig = Rig()
    capture: Capture = Capture()
    render: RenderSettings = RenderSettings()
    display: Display = Display()
    priority: int = Field(default=50, ge=0, le=100)
    """Higher goes first."""
    outputs: tuple[Output, ...] = OUTPUTS
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

    @field_validator("outputs")
    @classmethod
    def _each_once(cls, outputs: tuple[str, ...]) -> tuple[str, ...]:
        if len(set(outputs)) < len(outputs):
            raise ValueError("each output once")
        return outputs

    @model_validator(mode="after")
    def _fits_supersampled(self) -> Self:
        longest = max(self.rig.lens_array.count) * self.rig.px_per_lens * self.capture.supersample
        if longest > MAX_FRAME_PX:
            raise ValueError(f"count x px_per_lens x supersample of at most {MAX_FRAME_PX} px a side, got {longest} px")
        return self

    @model_validator(mode="after")
    def _ray_camera_alone(self) -> Self:
        if self.capture.method == "ray_camera" and self.render.antialias != "off":
            raise ValueError("capture.supersample in place of render.antialias with the ray camera, got antialias")
        if self.capture.method == "ray_camera" and self.rig.dispersion:
            raise ValueError("capture.method raytraced with rig.dispersion, got ray_camera, whose rays have one colour")
        return self

    @property
    def frame_numbers(self) -> tuple[int, ...]:
        """The frames asked for, rising."""
        return parse_frames(self.frames)

    def at(self, frame: int) -> JobSpec:
        """Return the job as it is at a frame: every keyframed number a constant.

        Raises
        ------
        ValidationError
            If a number is out of bounds there; `parse_spec` has tried every key.
        """
        if not self.animation:
            return self
        data = self.model_dump(mode="json", exclude={"animation"})
        for path, keyframes in self.animation.items():
            put(data, path, keyframes.at(frame))
        return JobSpec.model_validate(data)

    def at_keys(self) -> Iterator[tuple[int, JobSpec]]:
        """Yield (frame, job there) at the first frame, the last, and every key between them."""
        first, *_, last = (*self.frame_numbers[:1], *self.frame_numbers[-1:])
        keys = {key for keyframes in self.animation.values() for key, _ in keyframes.keyframes}
        for frame in sorted({first, last} | {key for key in keys if first < key < last}):
            yield frame, self.at(frame)


def parse_spec(data: Any) -> JobSpec:
    """Return the job that JSON data asks for.

    Raises
    ------
    SpecError
        With one `FieldProblem` for every field that is unknown, missing or out of bounds, at any keyframe.
    """
    if not isinstance(data, Mapping):
        raise SpecError(f"expected a job as a JSON object, got {type(data).__name__}")
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
    if path.partition(".")[0] not in ANIMATED_PARTS or any(
        path == field or path.startswith(f"{field}.") for field in STILL_FIELDS
    ):
        parts = ", ".join(f"{part}.*" for part in ANIMATED_PARTS)
        expected = f"a number of {parts} that does not change how many pixels a frame has"
        yield FieldProblem(field=path, expected=expected, got="keyframes")
        return
    for frame, value in spec.animation[path].keyframes:
        data = spec.model_dump(mode="json", exclude={"animation"})
        try:
            put(data, path, value)
            JobSpec.model_validate(data)
        except (KeyError, IndexError, TypeError):
            yield FieldProblem(field=path, expected="a field that is there to change", got="keyframes")
            return
        except ValidationError as error:
            for problem in problems_of(error):
                yield FieldProblem(field=path, expected=problem.expected, got=f"{value:g} at frame {frame}")
            return


def problems_of(error: ValidationError) -> tuple[FieldProblem, ...]:
    """Translate pydantic's errors: field, expected, got; not those of defaults that follow from what is wrong."""
    errors = (item for item in error.errors(include_url=False) if item["type"] != "default_factory_not_called")
    return tuple(_problem(item) for item in errors)


def _problem(item: Any) -> FieldProblem:
    field = ".".join(_place(untagged(item["loc"]))) or "(whole)"
    kind, got = item["type"], item["input"]
    if kind == "extra_forbidden":
        return FieldProblem(field=field, expected="no such field", got=_short(got))
    if kind == "missing":
        return FieldProblem(field=field, expected="a value", got="nothing")
    expected = str(item["msg"]).removeprefix("Value error, ")
    for prefix in ("Input should be ", "Value should be "):
        expected = expected.removeprefix(prefix)
    return FieldProblem(field=field, expected=expected, got=_short(got))


def _place(parts: tuple[str, ...]) -> tuple[str, ...]:
    """Return where a user wrote what is wrong: keyframes stand in place of the number that they move."""
    return parts[1:] if len(parts) > 1 and parts[0] == "animation" else parts


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 120 else text[:117] + "..."
