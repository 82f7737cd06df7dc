"""The lines that a worker and the program inside the sandbox exchange: requests, progress, results and failures.

Every message is one line of JSON. The worker believes neither the lines nor the files of the program: a line is bounded
by `MAX_LINE_BYTES`, and the models refuse unknown fields, names that are not plain file names, and numbers out of
bounds.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, model_validator

from lippmann.job.optics.rig import MAX_FRAME_PX
from lippmann.job.rendering.render_settings import Channel
from lippmann.job.resolved import ResolvedJob

MAX_LINE_BYTES = 4 << 20
"""The greatest length of a line in either direction."""
MAX_MESSAGE = 4000
"""The greatest length of the message of a failure, in characters."""
MAX_OBJECTS = 20_000
"""The greatest number of shapes of a scene."""
MAX_OBJECT_NAME, MAX_OBJECT_NAMES = 60, 250_000
"""The greatest length of the name of a shape, and of all names together with their quotation marks, in bytes."""
MAX_NOTES = 100
MAX_NOTE = 500
"""The greatest number of notes of a result, and the greatest length of one in characters."""

FILE_CHANNELS: dict[str, int] = {
    "radiance": 3,
    "distance": 1,
    "position": 3,
    "normal": 3,
    "albedo": 3,
    "object": 1,
    "motion": 3,
}
"""The numbers per pixel in each file of a result, little-endian float32, C order.

`radiance` is linear light. `distance` and `position` are in mm: the length of the ray from its start to the first hit
and the hit in the rig frame; infinite where the ray hits nothing. `normal` is a unit vector in the rig frame that faces
the ray. `albedo` is the diffuse reflectance, 0 to 1, or the base colour of a PBR material. Both are NaN where the ray
hits nothing. `object` is the number of the shape from 1, or 0. `motion` is that of the point of the surface in the
rig frame from this frame to the next, mm, NaN without a surface. Pixels without a ray are black and have NaN, or object
0."""

FileKind = Literal["radiance", "distance", "position", "normal", "albedo", "object", "motion"]
Px = Annotated[int, Field(ge=0, le=MAX_FRAME_PX)]
Seconds = Annotated[float, Field(ge=0, le=1e7, allow_inf_nan=False)]
ObjectName = Annotated[str, Field(max_length=MAX_OBJECT_NAME)]
Name = Annotated[str, Field(pattern=r"^[0-9A-Za-z][0-9A-Za-z_.-]{0,99}$")]


class UnsupportedError(Exception):
    """A request for what the program cannot do; the answer is a failure of the kind `unsupported`."""


class _Message(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    def line(self) -> bytes:
        """Return the message as one line with its end."""
        return self.model_dump_json().encode() + b"\n"


class Request(_Message):
    """A request to render a region of a picture."""

    number: int = Field(ge=0, le=2**53)
    """The number of the request, which its answer repeats."""
    job: ResolvedJob
    """The job at the frame; see `ResolvedJob.at`."""
    next_job: ResolvedJob | None = None
    """The job at the next frame, for the channel `motion`."""
    frame: int = Field(ge=0, le=10_000_000)
    """The number of the frame, which also seeds the samples."""
    rows: int = Field(ge=1, le=MAX_FRAME_PX)
    """The pixel rows of the whole picture."""
    cols: int = Field(ge=1, le=MAX_FRAME_PX)
    """The pixel columns of the whole picture."""
    region: tuple[Px, Px, Px, Px]
    """The wanted pixels, (row_start, row_stop, col_start, col_stop)."""
    channels: Annotated[tuple[Channel | Literal["position"], ...], Field(max_length=6)] = ()
    """The channels besides the radiance; `depth` gives the file `distance`."""
    light: bool = True
    """False for the channels alone."""
    bundle: str = Field(min_length=1, max_length=4096)
    """The absolute path of the folder of the scene bundle."""
    out: Name
    """The beginning of the names of the files of the result, in the working folder of the program."""

    @model_validator(mode="after")
    def _check_region(self) -> Self:
        row_start, row_stop, col_start, col_stop = self.region
        if not (row_start < row_stop <= self.rows and col_start < col_stop <= self.cols):
            message = f"expected a region of at least one pixel inside {self.rows} x {self.cols} px, got {self.region}"
            raise ValueError(message)
        if ("motion" in self.channels) != (self.next_job is not None):
            raise ValueError("expected the job at the next frame with the channel motion, and only then")
        if not self.light and not self.channels:
            raise ValueError("expected channels in a request without light, got none")
        return self

    @property
    def shape(self) -> tuple[int, int]:
        """The size of the region, (rows, cols)."""
        row_start, row_stop, col_start, col_stop = self.region
        return row_stop - row_start, col_stop - col_start

    @property
    def kinds(self) -> tuple[FileKind, ...]:
        """The kinds of files that the result has, in the order of `FILE_CHANNELS`."""
        wanted = {"distance" if channel == "depth" else channel for channel in self.channels}
        wanted |= {"radiance"} if self.light else set()
        return tuple(kind for kind in FILE_CHANNELS if kind in wanted)  # type: ignore[misc] # the keys are the kinds

    def file_name(self, kind: FileKind) -> str:
        """Return the name of a file of the result."""
        return f"{self.out}-{kind}.f32"

    def file_bytes(self, kind: FileKind) -> int:
        """Return the exact size of a file of the result in bytes."""
        return 4 * self.shape[0] * self.shape[1] * FILE_CHANNELS[kind]


class Progress(_Message):
    """A line before the answer that tells how much is traced."""

    progress: float = Field(ge=0, le=1)


class Result(_Message):
    """The answer to a request that is rendered."""

    number: int
    files: dict[FileKind, Name]
    """The files by their kind; see `Request.file_name`."""
    load_s: Seconds
    """The elapsed time in which the scene was loaded; 0 if it was there."""
    trace_s: Seconds
    """The elapsed time of the rendering."""
    trace_cpu_s: Seconds
    """The processor time of the rendering, all threads together."""
    notes: Annotated[tuple[Annotated[str, Field(max_length=MAX_NOTE)], ...], Field(max_length=MAX_NOTES)] = ()
    """The parts of the scene that the program left out or replaced, for the log."""
    objects: Annotated[tuple[ObjectName, ...], Field(max_length=MAX_OBJECTS)] = ()
    """The names of the shapes from number 1, if the channel `object` is wanted; empty where one has none."""


class Problem(_Message):
    """The reason why a request failed."""

    kind: Literal["scene", "unsupported", "internal"]
    """`scene`: the files of the bundle are wrong. `unsupported`: it asks for too much. `internal`: a fault of ours."""
    message: Annotated[str, Field(max_length=MAX_MESSAGE)]


class Failure(_Message):
    """The answer to a request that failed."""

    number: int | None
    """The number of the request; None if the line was no request."""
    error: Problem

    @classmethod
    def of(cls, number: int | None, kind: Literal["scene", "unsupported", "internal"], message: str) -> Self:
        """Return a failure with its message cut to the greatest length."""
        return cls(number=number, error=Problem(kind=kind, message=message[:MAX_MESSAGE]))


Answer = Progress | Result | Failure
_ANSWER: TypeAdapter[Answer] = TypeAdapter(Answer)


def read_answer(line: bytes) -> Answer:
    """Return the message of one line of the program.

    Raises
    ------
    ValueError
        If the line is longer than `MAX_LINE_BYTES` or no message.
    """
    if len(line) > MAX_LINE_BYTES:
        raise ValueError(f"expected a line of at most {MAX_LINE_BYTES} bytes, got {len(line)}")
    return _ANSWER.validate_json(line)


def read_request(line: bytes) -> Request:
    """Return the request of one line of the worker.

    Raises
    ------
    ValueError
        If the line is longer than `MAX_LINE_BYTES` or no request.
    """
    if len(line) > MAX_LINE_BYTES:
        raise ValueError(f"expected a line of at most {MAX_LINE_BYTES} bytes, got {len(line)}")
    return Request.model_validate_json(line)
