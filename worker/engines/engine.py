"""The protocol of an engine: it renders the pixels of a region of a frame, as light and as channels.

A task prepares the room, the engine renders in it, and the task stores the result. An engine knows neither orders nor
the artifact store.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.job.rendering.engines import Engine as EngineName
from lippmann.job.rendering.render_settings import Channel
from lippmann.job.resolved import ResolvedJob
from lippmann.plan.render_cache import RenderSoftware
from worker.sandbox.limits import Limits, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.sandbox import Sandbox


class Region(NamedTuple):
    """A part of a picture: pixels counted from 0, half-open."""

    row_start: int
    row_stop: int
    col_start: int
    col_stop: int


@dataclass(frozen=True)
class Wanted:
    """The pixels that an engine renders."""

    job: ResolvedJob
    """The job, whose stage is that at which the frame is rendered."""
    frame: int
    rows: int
    """The rows of the whole picture; its window is that of the integral image, whatever its size."""
    cols: int
    region: Region | None = None
    """The part to render; None for all."""
    channels: tuple[Channel, ...] = ()
    """The channels to render with the colours, by an engine that has them in one pass."""
    light: bool = True
    """False for the channels alone, by such an engine."""
    threads: int = 1
    """The number of threads that trace; with more than one, see `Engine.is_parallel`."""

    @property
    def part(self) -> Region:
        """The part to render, which may be all."""
        return self.region or Region(0, self.rows, 0, self.cols)


@dataclass(frozen=True)
class Room:
    """The surroundings in which an engine renders for one attempt."""

    folder: Path
    """The folder of the task, for files of the engine."""
    bundle: Path
    """The folder with the files of the scene bundle."""
    sandbox: Sandbox
    """The sandbox of the bundle."""
    program: str
    """The program of POV-Ray."""
    limits: Limits
    times: TimeLimits
    log: AttemptLog
    """The log of the attempt, which receives what the engine prints."""
    keep_bundle: Callable[[], AbstractContextManager[Path]]
    """Opens the bundle once more, for an engine that keeps its scene for further tasks."""
    keep_folder: Callable[[], AbstractContextManager[Path]]
    """Opens an empty folder, which such an engine keeps as long."""
    on_progress: Callable[[float], None]
    """Receives the progress, 0 to 1."""
    announce_end: Callable[[], None]
    """Announces that the core will soon be needed no longer."""
    should_stop: Callable[[], bool]


@dataclass(frozen=True)
class Rendered:
    """The pixels of a region and what they cost."""

    light: NDArray[np.float16]
    """Linear radiance, `(row, col, channel)` of the region; black if it was not wanted."""
    start_s: float
    """Seconds that do not depend on the number of pixels: start, and load or parse."""
    trace_cpu_s: float
    """CPU seconds of the pixels."""
    source: Path | None = None
    """The .pov that is kept with the tile; None from an engine that reads none."""
    tileable: bool = True
    """True if tiles are equal to the same pixels of the whole frame."""
    channels: Mapping[Channel, NDArray[np.float32]] = field(default_factory=dict)
    """The channels, each `(row, col)` or `(row, col, channel)` of the region. The depth is the distance along the ray
    from its start to the first surface, mm; infinite without one, and NaN without a ray. The others are those of
    `job.channels`, NaN or object 0 without a surface or a ray."""
    objects: tuple[str, ...] = ()
    """The names of the objects from number 1, if the channel `object` was wanted."""
    notes: tuple[str, ...] = ()
    """The parts of the scene that the engine left out or added, for the people of the job."""


@dataclass(frozen=True)
class SceneUse:
    """The variables that a scene reads besides its parameters, for the render cache."""

    clock: bool = True
    """True if it reads the clock."""
    frames: bool = True
    """True if it reads the number of the frame or another variable of the animation."""
    now: bool = False
    """True if it reads the time of day; its tiles are not cached."""


class Engine(Protocol):
    """A renderer. There is one object of each engine in a process."""

    @property
    def name(self) -> EngineName:
        """The name of the engine."""
        ...

    @property
    def has_channels(self) -> bool:
        """True if it renders channels with the colours; otherwise depth takes a second pass."""
        ...

    @property
    def is_warm(self) -> bool:
        """True if it keeps a scene for the next task, which then costs less."""
        ...

    @property
    def has_source(self) -> bool:
        """True if it renders a .pov, which is kept with the tile."""
        ...

    def check_installed(self, program: str) -> None:
        """Check that the engine works on this machine.

        Parameters
        ----------
        program
            The program of POV-Ray.

        Raises
        ------
        PovrayMissing, MitsubaMissing
            If it does not.
        """
        ...

    def end(self) -> None:
        """End what is kept for further tasks."""
        ...

    def software(self, program: str) -> RenderSoftware:
        """Return the software that makes the pixels, for the render cache.

        Parameters
        ----------
        program
            The program of POV-Ray.

        Raises
        ------
        LippmannError
            If the engine is not installed.
        """
        ...

    def scene_use(self, bundle: Path) -> SceneUse:
        """Return what the scene of a bundle reads."""
        ...

    def is_parallel(self, job: ResolvedJob, bundle: Path) -> bool:
        """Return whether several threads render the same pixels as one, and about as quickly as tiles do."""
        ...

    def render(self, wanted: Wanted, room: Room) -> Rendered:
        """Render a region of a frame.

        Raises
        ------
        LippmannError
            If the scene is refused, a limit is passed, the attempt shall stop, or the engine fails.
        """
        ...
