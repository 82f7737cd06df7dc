"""The parts that all loaders of scenes share: result, limits, notes, and names of files inside the bundle."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from lippmann.errors import SceneError
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.stage import Stage

Moving = Literal["clock", "stage"]
MOVING: tuple[Moving, ...] = ("clock", "stage")
"""The values that change from frame to frame besides parameters; a scene that reads none of them stays loaded."""

MAX_SHAPES = 20_000
MAX_FACES = 20_000_000
MAX_FILE_BYTES = 256 * 1024 * 1024
_MAX_NOTES = 50

AMBIENT_RADIANCE = 0.5
SUN_IRRADIANCE = 1.5
"""The default light: white surfaces get a radiance of 0.5 from all sides and up to 0.48 from the sun."""


@dataclass(frozen=True)
class LoadedScene:
    """A scene that was loaded into Mitsuba, in its own units and axes."""

    scene: Any
    """The `mi.Scene`."""
    notes: tuple[str, ...]
    """The parts that the loader left out or added."""
    reads: frozenset[Moving] = frozenset(MOVING)
    """The names of the changing values on which the scene depends."""
    names: Mapping[str, str] = field(default_factory=dict)
    """The names that the file gives to shapes, by the identifiers of the shapes if these are others."""


@dataclass
class SceneFiles:
    """The bundle that a loader reads, the values that a job gives its scene, and the notes."""

    bundle: Path
    """The absolute path of the folder of the bundle, without links."""
    job: ResolvedJob
    """The job at a frame."""
    clock_at_frame: float
    reads: set[Moving] = field(default_factory=set)
    """The names of the changing values that loaders have asked for."""
    notes: list[str] = field(default_factory=list)
    names: dict[str, str] = field(default_factory=dict)
    """The names of shapes that differ from their identifiers; see `LoadedScene`."""
    texture_px: int = 0
    """The pixels of all textures so far."""

    @property
    def clock(self) -> float:
        """The clock at the frame."""
        self.reads.add("clock")
        return self.clock_at_frame

    @property
    def stage(self) -> Stage:
        """The stage at the frame."""
        self.reads.add("stage")
        return self.job.stage

    @property
    def name(self) -> str:
        """The scene file, as the manifest names it."""
        return self.job.file

    def note(self, text: str) -> None:
        """Add a note once."""
        if text not in self.notes and len(self.notes) < _MAX_NOTES:
            self.notes.append(text)

    def refuse(self, place: str, expected: str, got: object) -> SceneError:
        """Return the error of a part of the scene that is wrong; the message names the place."""
        shown = str(got)
        return SceneError(f"{place}: expected {expected}, got {shown if len(shown) <= 200 else shown[:197] + '...'}")

    def path(self, name: str, *, beside: str, place: str, at_most: int = MAX_FILE_BYTES) -> Path:
        """Return the path of a file of the bundle.

        Parameters
        ----------
        name
            The name as the scene gives it, relative to the folder of `beside`.
        beside
            The file of the bundle that names it.
        place
            The place of the name in the scene, for the error.
        at_most
            The greatest size in bytes.

        Raises
        ------
        SceneError
            If the name is absolute, leads out of the bundle, is a link, or there is no such file of that size.
        """
        plain = name.replace("\\", "/")
        if not plain or plain.startswith("/") or "\0" in plain or ":" in plain.split("/")[0]:
            raise self.refuse(place, "the name of a file inside the bundle", repr(name))
        below = os.path.normpath((Path(beside).parent / plain).as_posix())
        if below.split("/")[0] == "..":
            raise self.refuse(place, "a file inside the bundle", repr(name))
        path = self.bundle
        for part in Path(below).parts:
            path = path / part
            if path.is_symlink():
                raise self.refuse(place, "a file inside the bundle", f"{name!r}, which is a link")
        if not path.is_file():
            raise self.refuse(place, "a file that is in the bundle", repr(name))
        size = path.stat().st_size
        if size > at_most:
            raise self.refuse(place, f"a file of at most {at_most:,} bytes", f"{name!r} of {size:,}")
        return path

    def value(self, name: str, default: float) -> float:
        """Return a parameter of the job that is a number, or a default if the scene has no such parameter."""
        given = self.job.parameters.get(name, default)
        if isinstance(given, str):
            raise self.refuse(f"parameters.{name}", "a number", repr(given))
        return float(given)

    def check_faces(self, count: int) -> None:
        """Refuse more faces than a scene may have."""
        if count > MAX_FACES:
            raise self.refuse(self.name, f"at most {MAX_FACES:,} faces in all", f"{count:,}")


def default_light(files: SceneFiles) -> dict[str, Any]:
    """Return the emitters of a scene that has none: the same light from all sides, and a sun beside the rig."""
    files.note(f"{files.name} has no light: it gets an even one from all sides and a sun from above the rig")
    stage = files.stage
    look = [there - here for here, there in zip(stage.location, stage.look_at, strict=True)]
    length, upward = (sum(share * share for share in vector) ** 0.5 for vector in (look, stage.up))
    direction = [share / length - 0.7 * up / upward for share, up in zip(look, stage.up, strict=True)]
    return {
        "lippmann_ambient": {"type": "constant", "radiance": {"type": "rgb", "value": AMBIENT_RADIANCE}},
        "lippmann_sun": {
            "type": "directional",
            "direction": direction,
            "irradiance": {"type": "rgb", "value": SUN_IRRADIANCE},
        },
    }
