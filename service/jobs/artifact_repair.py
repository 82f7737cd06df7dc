"""What rows call done and the store no longer has whole is made again: the first step of a retry.

A frame whose tile is missing or damaged fails in its assembly, and one whose masters are fails in the videos; the task
that fails is not the one that must be done again. So the tasks that made what cannot be read are taken back, their
artifacts first, and `retry` finds them with everything else that is not done.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice

from sqlalchemy.orm import Session

from lippmann.errors import ArtifactBroken, ArtifactMissing
from lippmann.job.orders import TaskKind, TileIndex
from lippmann.job.spec import JobSpec
from lippmann.job.states import JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from service.api.presenters import spec_of
from service.db import events as event_rows
from service.db import repair as mend_rows
from service.db.counters import move_tasks, shift
from service.db.engine import Database
from service.db.tables import EventTopic, Job, Task
from service.jobs.state_machine import find_job
from service.ports import ArtifactStore
from service.schemas.frame import FrameStatus

RETRIABLE = frozenset({JobStatus.FAILED, JobStatus.CANCELLED})
CODES = frozenset({ArtifactMissing.code, ArtifactBroken.code})
CHUNK = 200
"""Artifacts that are deleted in one transaction."""
_MASTER = re.compile(r"(?<!\d)(\d{4,})\.exr")
_AGAIN = {"failures": 0, "failed_on": [], "progress": None, "ended_s": None, "cpu_s": None, "wall_s": None}


def mend_job(database: Database, store: ArtifactStore, job_id: str) -> int:
    """Take back what cannot be read of a job that may be retried; returns how many tasks that was."""
    with database.reading() as session:
        job = find_job(session, job_id)
        if job.status not in RETRIABLE:
            return 0
        spec = spec_of(job)
    suspects = _suspects(database, store, job_id, spec)
    taken = 0
    while chunk := list(islice(suspects, CHUNK)):
        with database.writing() as session:
            row = session.get(Job, job_id)
            # True until this commits, so what is deleted is nobody's: another retry comes before or after.
            if row is None or row.status not in RETRIABLE:
                return taken
            taken += _take_back(session, store, job_id, [task.sequence for task in chunk])
    return taken


def _suspects(database: Database, store: ArtifactStore, job_id: str, spec: JobSpec) -> Iterator[Task]:
    """Yield the done tasks whose artifacts cannot be read, as far as the failures and the store tell."""
    unreadable, assemblies = mend_rows.unreadable, mend_rows.done_assemblies
    for page in _pages(database, lambda s, after: unreadable(s, job_id, TaskKind.ASSEMBLE, CODES, after=after)):
        damaged = {task.frame for task in page if task.error_code == ArtifactBroken.code}
        yield from _tiles(database, store, spec, job_id, [task.frame for task in page], damaged)
    with database.reading() as session:
        encodes = unreadable(session, job_id, TaskKind.ENCODE, CODES, after=-1)
    for page in _pages(database, lambda s, after: assemblies(s, job_id, after=after)) if encodes else ():
        bad = [task for task in page if _is_named(encodes, task.frame) or not _has_masters(store, spec, task)]
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
    """Yield the tiles of frames that are missing; all of a damaged frame, since which of them it was is not known."""
    with database.reading() as session:
        tiles = mend_rows.done_renders(session, job_id, frames)
    for task in tiles:
        if task.frame in damaged or not _are_there(store, job_id, _of_tile(spec, task)):
            yield task


def _take_back(session: Session, store: ArtifactStore, job_id: str, sequences: Sequence[int]) -> int:
    done = mend_rows.standing_of(session, job_id, TaskStatus.DONE, sequences=sequences)
    for task in done:
        store.delete(names.job_artifact(job_id, task.artifact))
    # CPU time was spent all the same; pixels and wall time go together, as the time left is told from them.
    shift(
        session,
        job_id,
        {},
        frames_done=-sum(task.kind is TaskKind.ASSEMBLE for task in done),
        done_px=-sum(task.weight_px for task in done),
        wall_s=-sum(task.wall_s or 0.0 for task in done),
    )
    _cancel(session, job_id, done, **_AGAIN)
    for frame in sorted({task.frame for task in done if task.frame is not None}):
        data = {"job": job_id, "frame": frame, "status": FrameStatus.WAITING.value}
        event_rows.announce(session, job_id, EventTopic.FRAME, data)
    return len(done)


def _cancel(session: Session, job_id: str, done: Sequence[Task], **values: object) -> None:
    """Leave tasks, and what was ready because of them, as a retry looks for them: it knows which must wait."""
    sequences = [task.sequence for task in done]
    stages = {task.stage for task in done}
    move_tasks(session, job_id, sequences, TaskStatus.DONE, TaskStatus.READY, **values)
    after = [task.sequence for task in mend_rows.standing_of(session, job_id, TaskStatus.READY, needs=stages)]
    move_tasks(session, job_id, [*sequences, *after], TaskStatus.READY, TaskStatus.CANCELLED)


def _pages(database: Database, ask: Callable[[Session, int], Sequence[Task]]) -> Iterator[Sequence[Task]]:
    after = -1
    while True:
        with database.reading() as session:
            page = ask(session, after)
        if not page:
            return
        yield page
        after = page[-1].sequence


def _is_named(encodes: Sequence[Task], frame: int | None) -> bool:
    """Return whether failures name a master of this frame; a damaged one without a name may be any."""
    found = [(task.error_code, _MASTER.search(task.error_message or "")) for task in encodes]
    return any(int(match[1]) == frame if match else code == ArtifactBroken.code for code, match in found)


def _of_tile(spec: JobSpec, render: Task) -> Iterator[str]:
    """Yield the names of what a render leaves for its frame's assembly."""
    yield render.artifact
    if spec.capture.depth:
        assert render.frame is not None  # noqa: S101 - the plan's promise
        assert render.tile_row is not None  # noqa: S101
        assert render.tile_col is not None  # noqa: S101
        yield names.depth_tile_name(render.frame, TileIndex(row=render.tile_row, col=render.tile_col))


def _has_masters(store: ArtifactStore, spec: JobSpec, assembly: Task) -> bool:
    assert assembly.frame is not None  # noqa: S101 - the plan's promise
    return _are_there(store, assembly.job_id, _masters(spec, assembly.frame))


def _masters(spec: JobSpec, frame: int) -> Iterator[str]:
    """Yield the names of what an assembly leaves."""
    for name in (names.thumb_name, names.integral_name, names.orthoscopic_name, names.views_name):
        yield name(frame)
    if spec.capture.depth:
        yield names.depth_name(frame)
    if spec.rig.device is not None:
        yield names.device_name(frame)


def _are_there(store: ArtifactStore, job_id: str, wanted: Iterable[str]) -> bool:
    return all(store.exists(names.job_artifact(job_id, name)) for name in wanted)
