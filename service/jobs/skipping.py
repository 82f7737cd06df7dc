"""Skipped frames: their tasks count as neither failed nor missing, and the outputs are made without them.

Tiles of such a frame that are done stay done. A retry of the job brings the frame back; the outputs that were made
without it are made again.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable

from sqlalchemy.orm import Session

from lippmann.errors import FieldProblem
from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import SATISFIED_TASKS, JobAction, TaskStatus, actions_for
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore
from service.db import tasks as task_rows
from service.db.counters import add_to_counters
from service.db.engine import Database
from service.db.tables import Job, Task
from service.errors import Invalid, TransitionNotAllowed
from service.events.publish import publish_frames
from service.jobs.state_machine import RESET, find_job, transition_tasks
from service.jobs.verification import expected_artifacts


def skip(session: Session, row: Job, frames: Collection[int] | None, *, now_s: float) -> None:
    """Skip the tasks of some frames of an ended job, by default of those that failed.

    Raises
    ------
    Invalid
        If the job has no such frame.
    TransitionNotAllowed
        If the job is not planned, no frame has failed, a frame is done already, or no frame would be left.
    """
    wanted = _checked(session, row, frames)
    tasks = [task for task in task_rows.of_frames(session, row.id, wanted) if task.status not in SATISFIED_TASKS]
    _move(session, row.id, tasks, TaskStatus.SKIPPED, ended_s=now_s)
    add_to_counters(session, {row.id: {"total_px": -sum(task.weight_px for task in tasks)}})
    publish_frames(session, row.id, wanted)
    session.refresh(row)


def bring_back(session: Session, row: Job) -> None:
    """Let a job make its skipped frames, and then its outputs again; see `remove_outputs_without_frames`."""
    frames = task_rows.skipped_frames(session, [row.id])[row.id]
    skipped = [task for task in task_rows.of_frames(session, row.id, frames) if task.status is TaskStatus.SKIPPED]
    outputs = [task for task in task_rows.outputs(session, row.id) if task.status is TaskStatus.DONE]
    add_to_counters(
        session,
        {
            row.id: {
                "total_px": sum(task.weight_px for task in skipped),
                "done_px": -sum(task.weight_px for task in outputs),
                "wall_s": -sum(task.wall_s or 0.0 for task in outputs),
            }
        },
    )
    again = {**RESET, "progress": None, "cpu_s": None, "wall_s": None, "digests": None}
    _move(session, row.id, [*skipped, *outputs], TaskStatus.READY, **again)
    # The tiles of these frames are not done now, so the assemblies wait for them, and the outputs for the assemblies.
    blocked = task_rows.blocked(session, row.id, {task.stage for task in skipped}, [])
    transition_tasks(session, row.id, blocked, TaskStatus.READY, TaskStatus.WAITING)
    publish_frames(session, row.id, frames)
    session.refresh(row)


def remove_outputs_without_frames(database: Database, store: ArtifactStore, job_id: str) -> None:
    """Delete the outputs of a job that will be retried, if it has skipped frames: a worker makes no output that exists.

    If the retry does not follow, the outputs are missing, and are made again as any missing artifact is.
    """
    with database.reading() as session:
        row = find_job(session, job_id)
        if not row.skipped or JobAction.RETRY not in actions_for(row.status, row.paused_by, skipped=row.skipped):
            return
        spec = row.parsed_spec
        found = {name for task in task_rows.outputs(session, job_id) for name in expected_artifacts(spec, task)}
    found |= {names.sidecar_name(output) for output in spec.outputs}
    found |= {f"{names.output_folder(output)}/" for output in spec.outputs if not output.IS_VIDEO}
    for name in sorted(found):
        store.delete(names.job_artifact(job_id, name))


def _checked(session: Session, row: Job, frames: Collection[int] | None) -> set[int]:
    """Return the frames to skip."""
    if row.planned_s is None:
        raise TransitionNotAllowed("cannot skip frames of a job that is not planned: its probe did not succeed")
    wanted = set(task_rows.failed_frames(session, row.id) if frames is None else frames)
    if not wanted:
        raise TransitionNotAllowed("cannot skip the failed frames: none has failed; name the frames to skip")
    known = set(row.parsed_spec.frame_numbers)
    if not wanted <= known:
        problem = FieldProblem(field="frames", expected="frames of the job", got=str(sorted(wanted - known)[0]))
        raise Invalid(str(problem), problems=[problem])
    assemblies = {
        task.frame: task.status
        for task in task_rows.of_frames(session, row.id, wanted)
        if task.kind is TaskKind.ASSEMBLE
    }
    done = sorted(frame for frame in wanted if assemblies[frame] is TaskStatus.DONE)
    if done:
        raise TransitionNotAllowed(f"cannot skip frame {done[0]}: it is done")
    already = task_rows.skipped_frames(session, [row.id]).get(row.id, ())
    if wanted.union(already) == known:
        raise TransitionNotAllowed("cannot skip every frame of a job: at least one must be left")
    return wanted


def _move(session: Session, job_id: str, tasks: Iterable[Task], to: TaskStatus, **values: object) -> None:
    groups: dict[TaskStatus, list[int]] = defaultdict(list)
    for task in tasks:
        groups[task.status].append(task.sequence)
    for was, sequences in groups.items():
        transition_tasks(session, job_id, sequences, was, to, **values)
