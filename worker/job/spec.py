"""The job as it was asked for: scene, frames, rig, render settings and outputs.

`parse_spec` is the one door: it takes the JSON of a job file and gives a `JobSpec`, or a `SpecError` that names every
field that is wrong, what was expected there and what came.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from worker.errors import FieldProblem, SpecError
from worker.job.frames import parse_frames

MIN_PX_PER_LENS = 2
"""One pixel per lens holds one view: no parallax, hence no integral image."""

MAX_FRAME_PX = 32_768
"""The longest side of an integral image that one frame may have."""

PAPER_CAMERA_ANGLE_DEG = 6.738
"""One tenth of POV-Ray's default 67.38 degrees (Athineos et al. 2006, section 3.2)."""

ParameterValue = bool | int | float | str

Output = Literal["views.mp4", "centre.mp4", "orthoscopic.mkv"]

OUTPUTS: tuple[Output, ...] = get_args(Output)
"""The videos that a job can ask for."""


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class LensArray(_Part):
    """The microlens array (MLA)."""

    lattice: Literal["square"] = "square"
    count: tuple[Annotated[int, Field(ge=1, le=4096)], Annotated[int, Field(ge=1, le=4096)]] = (90, 90)
    """Lenses as (lens_rows, lens_cols)."""
    pitch_mm: float = Field(default=1.0, gt=0, le=1000)
    focal_length_mm: float = Field(default=3.3, gt=0, le=10_000)
    index: float = Field(default=1.49, gt=1, le=4)
    aperture: Literal["full", "inscribed"] = "full"
    """Where the rim of a lens lies: through the corners of its cell, or on the circle inside it."""
    offset_mm: float = 40.0
    """From the image of the scene's reference plane to the MLA, positive toward the imaging lens."""


class Camera(_Part):
    """The camera behind the MLA."""

    projection: Literal["orthographic", "perspective"] = "orthographic"
    angle_deg: float = Field(default=PAPER_CAMERA_ANGLE_DEG, gt=0, lt=90)
    """Full angle of view of the perspective camera; its distance follows from it."""


class Rig(_Part):
    """Imaging lens, MLA and camera."""

    imaging_lens: str = Field(default="athineos-2006", min_length=1, max_length=100)
    lens_array: LensArray = LensArray()
    camera: Camera = Camera()
    px_per_lens: int = Field(default=8, ge=MIN_PX_PER_LENS, le=512)

    @model_validator(mode="after")
    def _fits_in_a_picture(self) -> Self:
        longest = max(self.lens_array.count) * self.px_per_lens
        if longest > MAX_FRAME_PX:
            raise ValueError(f"count x px_per_lens of at most {MAX_FRAME_PX} px a side, got {longest} px")
        return self


class RenderSettings(_Part):
    """How POV-Ray renders, and when an attempt is given up."""

    antialias: Literal["off"] = "off"
    tiles: Literal["auto"] | tuple[Annotated[int, Field(ge=1, le=64)], Annotated[int, Field(ge=1, le=64)]] = "auto"
    """Tiles of a frame as (tile_rows, tile_cols), or cut by the measured cost."""
    timeout_s: float = Field(default=6 * 3600.0, ge=1, le=7 * 86_400)
    """An attempt that runs longer is ended."""
    stall_s: float = Field(default=600.0, ge=1, le=86_400)
    """An attempt without progress for longer is ended."""
    memory_mb: int = Field(default=8192, ge=128, le=1_048_576)
    """Address space that one POV-Ray process may take."""


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
    clock: Clock | None = None
    """The scene's own clock when not given."""
    frames: Annotated[str, Field(max_length=1000), AfterValidator(_check_frames)] = "1"
    fps: float = Field(default=8.0, gt=0, le=240)
    rig: Rig = Rig()
    render: RenderSettings = RenderSettings()
    priority: int = Field(default=50, ge=0, le=100)
    """Higher goes first."""
    outputs: tuple[Output, ...] = OUTPUTS

    @field_validator("outputs")
    @classmethod
    def _each_once(cls, outputs: tuple[str, ...]) -> tuple[str, ...]:
        if len(set(outputs)) < len(outputs):
            raise ValueError("each output once")
        return outputs

    @property
    def frame_numbers(self) -> tuple[int, ...]:
        """The frames asked for, rising."""
        return parse_frames(self.frames)


def parse_spec(data: Any) -> JobSpec:
    """Return the job that JSON data asks for.

    Raises
    ------
    SpecError
        With one `FieldProblem` for every field that is unknown, missing or out of bounds.
    """
    if not isinstance(data, Mapping):
        raise SpecError(f"expected a job as a JSON object, got {type(data).__name__}")
    try:
        return JobSpec.model_validate(data)
    except ValidationError as error:
        raise SpecError.of(problems_of(error)) from error


def problems_of(error: ValidationError) -> tuple[FieldProblem, ...]:
    """Translate pydantic's errors: field, expected, got."""
    return tuple(_problem(item) for item in error.errors(include_url=False))


def _problem(item: Any) -> FieldProblem:
    field = ".".join(str(part) for part in item["loc"]) or "(whole)"
    kind, got = item["type"], item["input"]
    if kind == "extra_forbidden":
        return FieldProblem(field=field, expected="no such field", got=_short(got))
    if kind == "missing":
        return FieldProblem(field=field, expected="a value", got="nothing")
    expected = str(item["msg"]).removeprefix("Value error, ")
    for prefix in ("Input should be ", "Value should be "):
        expected = expected.removeprefix(prefix)
    return FieldProblem(field=field, expected=expected, got=_short(got))


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 120 else text[:117] + "..."
