"""Which task of a job makes an artifact, and which artifacts a task makes: both follow from names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from lippmann.job.messages.orders import TaskKind, TileIndex
from lippmann.job.spec import JobSpec
from lippmann.plan import artifact_names as names

_TILE = re.compile(r"(?:tiles|depth-tiles|channel-tiles)/(\d{4,9})/(\d{2,4})-(\d{2,4})\.exr", re.ASCII)
_OF_FRAME = re.compile(
    r"(?:integral|orthoscopic|device|views|depth|channels)/(\d{4,9})\.exr|thumbs/(\d{4,9})\.webp", re.ASCII
)


@dataclass(frozen=True)
class Maker:
    """The task that makes an artifact."""

    kind: TaskKind
    frame: int | None = None
    tile: TileIndex | None = None
    output: str | None = None


def maker_of(spec: JobSpec, name: str) -> Maker | None:
    """Return the task that makes an artifact, by its name below the job; None for a file that no task makes.

    Logs and the .pov texts of tiles have no maker here: nothing is made from them.

    >>> maker_of(JobSpec(scene="fish"), "orthoscopic/0007.exr")
    Maker(kind=<TaskKind.ASSEMBLE: 'assemble'>, frame=7, tile=None, output=None)
    """
    tile = _TILE.fullmatch(name)
    if tile is not None:
        frame, row, col = map(int, tile.groups())
        return Maker(TaskKind.RENDER, frame=frame, tile=TileIndex(row=row, col=col))
    of_frame = _OF_FRAME.fullmatch(name)
    if of_frame is not None:
        return Maker(TaskKind.ASSEMBLE, frame=int(of_frame[1] or of_frame[2]))
    for output in spec.outputs:
        if name in (names.output_name(output), names.sidecar_name(output)):
            return Maker(TaskKind.ENCODE, output=output.file_name)
        if not output.IS_VIDEO and name.startswith(f"{names.output_folder(output)}/"):
            return Maker(TaskKind.ENCODE, output=output.file_name)
    return None


def artifacts_of(
    spec: JobSpec, kind: TaskKind, *, frame: int | None, tile: TileIndex | None, artifact: str
) -> Iterator[str]:
    """Yield the names of the artifacts that a task stores for others; the one that marks it as done is the last.

    Parameters
    ----------
    artifact
        The artifact that exists when the task is done; an empty name for a task without one.
    """
    if kind is TaskKind.RENDER and frame is not None and tile is not None:
        yield from names.tile_artifacts(spec, frame, tile)
        return
    if kind is TaskKind.ASSEMBLE and frame is not None:
        yield from names.masters(spec, frame)
    if artifact:
        yield artifact
