"""Artifact repair, the first step of a retry: done tasks whose artifacts cannot be read are taken back.

The task that fails is not the one that must run again: if a tile is missing or damaged, the assembly of its frame
fails, and if a master is, the outputs fail. So the tasks that made an unreadable artifact are taken back, their
artifacts first, and the retry runs them with all other tasks that are not done.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice

from sqlalchemy.orm import Session

from lippmann.errors import ArtifactBroken, ArtifactMissing
from lippmann.job.messages.orders import TaskKind
from lippmann.job.spec import JobSpec
from lippmann.job.states import JOB_ACTIONS, FrameStatus, JobAction, TaskStatus
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore
from service.db import tasks as task_rows
from service.db.counters import add_to_counters
from service.db.engine import Database
from service.db.tables import Job, Task
from service.events.publish import publish_frames
from service.jobs.state_machine import find_job, transition_tasks

RETRIABLE = JOB_ACTIONS[JobAction.RETRY].allowed_in
CODES = frozenset({ArtifactMissing.code, ArtifactBroken.code})
CHUNK = 200
"""The largest number of artifacts that one transaction deletes."""
_RESET = {"failures": 0, "failed_on": [], "progress": None, "ended_s": None, "cpu_s": None, "wall_s": None}


def repair_artifacts(database: Database, store: ArtifactStore, job_id: str) -> int:
    """Take back the tasks of a retriable job whose artifacts cannot be read, and return their number."""
    with database.reading() as session:
        job = find_job(session, job_id)
        if job.status not in RETRIABLE:
            return 0
        spec = job.parsed_spec
    suspects = _suspects(database, store, job_id, spec)
    count = 0
    while chunk := list(islice(suspects, CHUNK)):
        with database.writing() as session:
            row = session.get(Job, job_id)
            # The status holds until this commits, so no attempt reads what is deleted; a concurrent retry comes first
            # or afterwards.
            if row is None or row.status not in RETRIABLE:
                return count
            count += _take_back(session, store, job_id, [task.sequence for task in chunk])
    return count


def _suspects(database: Database, store: ArtifactStore, job_id: str, spec: JobSpec) -> Iterator[Task]:
    """Yield the done tasks whose artifacts cannot be read, according to the failures and to the store."""
    unreadable, assemblies = task_rows.unreadable, task_rows.done_assemblies
    for page in _pages(database, lambda s, after: unreadable(s, job_id, TaskKind.ASSEMBLE, CODES, after=after)):
        damaged = {task.frame for task in page if task.error_code == ArtifactBroken.code}
        yield from _tiles(database, store, spec, job_id, [task.frame for task in page], damaged)
    with database.reading() as session:
        encodes = unreadable(session, job_id, TaskKind.ENCODE, CODES, after=-1)
    for page in _pages(database, lambda s, after: assemblies(s, job_id, after=after)) if encodes else ():
        bad = [task for task in page if _is_blamed(encodes, task.frame) or not _has_masters(store, spec, task)]
        yield from bad
        if bad:
            yield from _tiles(database, store, spec, job_id, [task.frame for task in bad], set())


def _tiles(
    database: Database,
    store: ArtifactStore,
    spec: JobSpec,
    job_id: str,
    frames: Sequence[int | None],
    damaged: set[int | None],
) -> Iterator[Task]:
    """Yield the missing tiles of frames; all tiles of a damaged frame, since the failure names no tile."""
    with database.reading() as session:
        tiles = task_rows.done_renders(session, job_id, frames)
    for task in tiles:
        if task.frame in damaged or not _all_exist(store, job_id, _artifacts_of_render(spec, task)):
            yield task


def _take_back(session: Session, store: ArtifactStore, job_id: str, sequences: Sequence[int]) -> int:
    done = task_rows.numbered(session, job_id, sequences, status=TaskStatus.DONE)
    for task in done:
        store.delete(names.job_artifact(job_id, task.artifact))
    # The CPU time was spent all the same. Pixels and wall time are subtracted together, since the estimate of the time
    # left divides one by the other.
    gains = {
        "frames_done": -sum(task.kind is TaskKind.ASSEMBLE for task in done),
        "done_px": -sum(task.weight_px for task in done),
        "wall_s": -sum(task.wall_s or 0.0 for task in done),
    }
    add_to_counters(session, {job_id: gains})
    _cancel(session, job_id, done)
    frames = sorted({task.frame for task in done if task.frame is not None})
    publish_frames(session, job_id, frames, FrameStatus.WAITING)
    return len(done)


def _cancel(session: Session, job_id: str, done: Sequence[Task]) -> None:
    """Cancel tasks and the ready tasks that need them; the retry finds out which of them have to wait."""
    sequences = [task.sequence for task in done]
    transition_tasks(session, job_id, sequences, TaskStatus.DONE, TaskStatus.READY, **_RESET)
    after = task_rows.needing(session, job_id, {task.stage for task in done}, status=TaskStatus.READY)
    ready = [*sequences, *(task.sequence for task in after)]
    transition_tasks(session, job_id, ready, TaskStatus.READY, TaskStatus.CANCELLED)


def _pages(database: Database, query: Callable[[Session, int], Sequence[Task]]) -> Iterator[Sequence[Task]]:
    after = -1
    while True:
        with database.reading() as session:
            page = query(session, after)
        if not page:
            return
        yield page
        after = page[-1].sequence


def _is_blamed(encodes: Sequence[Task], frame: int | None) -> bool:
    """Return whether a failed output names this frame; a damaged master whose frame is unknown may be any."""
    return any(
        task.error_code == ArtifactBroken.code if task.error_frame is None else task.error_frame == frame
        for task in encodes
    )


def _artifacts_of_render(spec: JobSpec, render: Task) -> Iterator[str]:
    """Yield the names of the artifacts that a render task leaves for the assembly of its frame."""
    yield render.artifact
    if spec.capture.depth:
        assert render.frame is not None  # noqa: S101 - every planned render has a frame and a tile
        assert render.tile is not None  # noqa: S101 - see above
        yield names.depth_tile_name(render.frame, render.tile)


def _has_masters(store: ArtifactStore, spec: JobSpec, assembly: Task) -> bool:
    assert assembly.frame is not None  # noqa: S101 - every planned assembly has a frame
    return _all_exist(store, assembly.job_id, _masters(spec, assembly.frame))


def _masters(spec: JobSpec, frame: int) -> Iterator[str]:
    """Yield the names of the artifacts that an assembly task leaves."""
    for name in (names.thumb_name, names.integral_name, names.orthoscopic_name, names.views_name):
        yield name(frame)
    if spec.capture.depth:
        yield names.depth_name(frame)
    if spec.rig.device is not None:
        yield names.device_name(frame)


def _all_exist(store: ArtifactStore, job_id: str, wanted: Iterable[str]) -> bool:
    return all(store.exists(names.job_artifact(job_id, name)) for name in wanted)
