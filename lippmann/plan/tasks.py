"""Plan the tasks of a job.

Dependencies are stages: a task belongs to one stage and may need one. It is ready when every task of the stage it
needs is done: `assemble` of a frame needs `render/<frame>`, every `encode` needs `assemble`. Where nothing is rendered,
because the sheets are there already, `assemble` needs nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from lippmann.job.animation.clock import Clock
from lippmann.job.messages.events import ProbeResult
from lippmann.job.messages.orders import TaskKind, TileIndex
from lippmann.job.resolved import StoredPlan
from lippmann.job.spec import JobSpec
from lippmann.plan import artifact_names as names
from lippmann.plan.cost import tile_grid
from lippmann.plan.sampling import cut_tiles, frame_size

ASSEMBLE_STAGE = "assemble"
ENCODE_STAGE = "encode"
RENDERS_NOTHING = (ASSEMBLE_STAGE, ENCODE_STAGE)
"""The stages whose tasks do not need the engine of the job."""
PROBE_STAGE = "probe"


@dataclass(frozen=True)
class PlannedTask:
    """One task of a plan."""

    kind: TaskKind
    stage: str
    needs: str | None
    sequence: int
    """The order of the tasks of a job: the previews first, then by frames, and a frame's assembly before the next
    frame's tiles."""
    weight_px: int
    """The share of the task in the job, for the progress."""
    artifact: str
    """The artifact that exists when the task is done."""
    frame: int | None = None
    tile: TileIndex | None = None
    output: str | None = None


def probe_task() -> PlannedTask:
    """Return the task that every job starts with."""
    return PlannedTask(kind=TaskKind.PROBE, stage=PROBE_STAGE, needs=None, sequence=0, weight_px=0, artifact="")


def plan_sheet(
    spec: JobSpec, probe: ProbeResult, *, slots: int, idle_workers: int = 0, clock: Clock | None = None
) -> StoredPlan:
    """Return the plan of a job.

    Parameters
    ----------
    probe
        The measurements of the probe.
    slots
        The number of slots of the farm.
    idle_workers
        The number of workers that have these slots; 0 if they have other work.
    clock
        The clock of the job, which is its scene's if the specification has none.
    """
    rows, cols = tile_grid(spec, probe, slots=slots, idle_workers=idle_workers)
    return StoredPlan(
        tile_rows=rows,
        tile_cols=cols,
        probe_start_s=probe.start_s,
        probe_s_per_px=probe.s_per_px,
        renders=probe.renders,
        camera=probe.camera,
        previews=previews(spec.frame_numbers, clock),
    )


def previews(frames: Sequence[int], clock: Clock | None = None) -> tuple[int, ...]:
    """Return the first, the middle and the last frame, by which a user judges a job before the others are rendered.

    Of a motion that repeats they are those of its first turn: equal frames would be rendered at the same time, when the
    render cache has none of them.

    >>> previews(range(1, 91))
    (1, 46, 90)
    >>> previews(range(1, 91), Clock(repeat_frames=45))
    (1, 23, 45)
    """
    first_at: dict[float, int] = {}
    for frame in frames:
        first_at.setdefault(frame if clock is None else clock.at(frame), frame)
    turn = [*first_at.values()]
    return tuple(dict.fromkeys(turn[index] for index in (0, len(turn) // 2, -1)))


def plan_tasks(spec: JobSpec, plan: StoredPlan) -> Iterator[PlannedTask]:
    """Yield every task after the probe, in order."""
    size = frame_size(spec.rig)
    tiles = cut_tiles(size, tile_rows=plan.tile_rows, tile_cols=plan.tile_cols) if plan.renders else ()
    sequence = 1
    for frame in dict.fromkeys((*plan.previews, *spec.frame_numbers)):
        stage = f"render/{names.frame_stem(frame)}" if plan.renders else None
        for tile in tiles:
            artifact = names.tile_name(frame, tile.index)
            assert stage is not None  # noqa: S101 - there are tiles
            yield PlannedTask(TaskKind.RENDER, stage, None, sequence, tile.px, artifact, frame=frame, tile=tile.index)
            sequence += 1
        weight = size.px // 20 if plan.renders else size.px
        yield PlannedTask(
            TaskKind.ASSEMBLE, ASSEMBLE_STAGE, stage, sequence, weight, names.thumb_name(frame), frame=frame
        )
        sequence += 1
    for output in spec.outputs:
        yield PlannedTask(
            TaskKind.ENCODE, ENCODE_STAGE, ASSEMBLE_STAGE, sequence, size.px // 20, names.output_name(output),
            output=output.file_name,
        )  # fmt: skip
        sequence += 1
