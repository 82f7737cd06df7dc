"""Artifact repair: done tasks whose artifacts are missing or damaged are taken back, so that the farm repeats them.

The task that fails is not the one that must run again: if a tile is damaged, the assembly of its frame fails, and if a
master is, the outputs fail. So the tasks that made a damaged artifact are taken back, their artifacts first, and the
tasks that need them wait again. The coordinator does this while a job runs (`service.coordinator.artifact_repairer`),
a request that reads a damaged artifact does it for that artifact (`repair_artifact`), and a retry does it for the
artifacts that the failures name (`repair_artifacts`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator, Sequence

from sqlalchemy.orm import Session

from lippmann.errors import ArtifactBroken, ArtifactMissing
from lippmann.job.messages.orders import TaskKind
from lippmann.job.spec import JobSpec
from lippmann.job.states import JOB_ACTIONS, JobAction, JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore
from lippmann.plan.makers import maker_of
from service.db import tasks as task_rows
from service.db.counters import add_to_counters
from service.db.engine import Database
from service.db.tables import Job, Task
from service.events.publish import publish_frames
from service.jobs.state_machine import find_job, transition_job, transition_tasks
from service.jobs.verification import Damage, Finding, expected_artifacts, verify_tasks

RETRIABLE = JOB_ACTIONS[JobAction.RETRY].allowed_in
CODES = frozenset({ArtifactMissing.code, ArtifactBroken.code})
"""The codes of failures that are about an artifact that the attempt read."""
REPAIRS_ALLOWED = 1
"""The number of times that the farm makes the artifacts of one task again by itself."""
CHUNK = 200
"""The largest number of tasks that are verified together, and of those that one transaction takes back."""
DELETE_S = 1.0
"""The time for which artifacts are deleted before their tasks are taken back."""
REPAIRED_IN = frozenset({JobStatus.RUNNING, JobStatus.PAUSED, JobStatus.DONE})
"""The statuses of a job whose damaged artifacts are made again without an action of a user."""
_RESET = {
    "failures": 0,
    "losses": 0,
    "failed_on": [],
    "progress": None,
    "ended_s": None,
    "cpu_s": None,
    "wall_s": None,
    "digests": None,
    "cached": False,
    "stored_bytes": 0,
}


def repair_artifacts(database: Database, store: ArtifactStore, job_id: str) -> int:
    """Take back the tasks of a retriable job whose artifacts its failures found damaged, and return their number."""
    count, after = 0, -1
    while True:
        with database.reading() as session:
            job = find_job(session, job_id)
            if job.status not in RETRIABLE:
                return count
            failed = task_rows.unreadable(session, job_id, CODES, after=after)
        if not failed:
            return count
        after = failed[-1].sequence
        found = list(dict.fromkeys(damage_found_by(database, store, job.parsed_spec, failed)))
        # A concurrent retry may come in between. An attempt of it that misses an artifact has it made again.
        count += take_back_in_chunks(
            database, store, job_id, found, allowed=lambda row: row.status in RETRIABLE, by_itself=False
        )


def repair_artifact(
    database: Database, store: ArtifactStore, job_id: str, name: str, *, cannot_be_read: bool = False
) -> bool:
    """Take back the task that makes a damaged artifact of a job; return whether the farm makes the artifact again.

    A done job runs again. A job that failed or was cancelled stays as it is, and so does a task that the farm has
    repeated by itself already.

    Parameters
    ----------
    name
        The name below the job.
    cannot_be_read
        True if a reader found the artifact damaged; this decides where its digest is unknown.
    """
    with database.reading() as session:
        job = find_job(session, job_id)
        task = find_maker(session, job, name)
        if task is None or job.status not in REPAIRED_IN:
            return False
        if task.status is not TaskStatus.DONE:
            return task.repairs > 0
        spec = job.parsed_spec
    found = [each for each in verify_tasks(store, spec, [task]) if each.artifact == name]
    if not found and cannot_be_read and name in _unproven(spec, task, name):
        found = [Finding(job_id, task.sequence, name, Damage.CONTENT, f"{name}: cannot be read")]
    if not found or task.repairs >= REPAIRS_ALLOWED:
        return False
    with database.writing() as session:
        row = find_job(session, job_id)
        if not _is_repaired(row):
            return row.background_job is not None
        if row.status is JobStatus.DONE:
            transition_job(session, row, JobStatus.RUNNING, ended_s=None)
        take_back(session, store, job_id, found, by_itself=True)
    return True


def repair_tasks(database: Database, store: ArtifactStore, job_id: str, sequences: Sequence[int]) -> None:
    """Verify what some tasks stored, and take back those whose artifacts are missing or damaged; a done job runs again.

    A job that failed or was cancelled, or whose artifacts are being repaired, stays as it is.

    Raises
    ------
    NotFound
        If the job does not exist.
    """
    for start in range(0, len(sequences), CHUNK):
        with database.reading() as session:
            row = find_job(session, job_id)
            tasks = task_rows.done_among(session, job_id, sequences[start : start + CHUNK])
        if not _is_repaired(row):
            return
        found = list(verify_tasks(store, row.parsed_spec, tasks))
        take_back_in_chunks(database, store, job_id, found, allowed=_is_repaired, by_itself=False)


def damage_found_by(
    database: Database, store: ArtifactStore, spec: JobSpec, failed: Sequence[Task]
) -> Iterator[Finding]:
    """Yield the damaged artifacts that made tasks fail, and those that are read to make them again.

    What a failure names is examined, and what it could mean where it names nothing. An artifact with a known digest is
    judged by it; one without is taken to be damaged if the failure says so.
    """
    for task in failed:
        damaged_frames: set[int | None] = set()
        for suspects in _suspects(database, spec, task):
            for finding in _damage(store, spec, suspects, task):
                yield finding
                frames = {suspect.frame for suspect in suspects if suspect.sequence == finding.sequence}
                damaged_frames |= frames if task.kind is TaskKind.ENCODE else set()
        if damaged_frames:
            with database.reading() as session:
                tiles = task_rows.done_renders(session, task.job_id, damaged_frames)
            yield from verify_tasks(store, spec, tiles)


def take_back_in_chunks(
    database: Database, store: ArtifactStore, job_id: str, found: Sequence[Finding],
    *, allowed: Callable[[Job], bool], by_itself: bool,
) -> int:  # fmt: skip
    """Take back the done tasks of findings while the job allows it, and return their number; a done job runs again.

    The artifacts of each chunk are deleted before its transaction. A bucket takes a while for each of them, and all
    other writers of the farm would wait. A process that ends in between leaves done tasks whose artifacts are missing,
    which is found as any damage is.

    Parameters
    ----------
    allowed
        Returns whether the job is still one whose tasks are taken back.
    by_itself
        See `take_back`.
    """
    with database.reading() as session:
        names_of = _artifacts_to_delete(session, job_id, found)
    count, gone = 0, list[int]()
    if not names_of:
        return count
    while True:
        # The first transaction takes nothing back: before anything is deleted, it shows that this process leads.
        with database.writing() as session:
            row = session.get(Job, job_id)
            if row is None or not allowed(row):
                return count
            if gone and row.status is JobStatus.DONE:
                transition_job(session, row, JobStatus.RUNNING, ended_s=None)
            count += _reset(session, job_id, gone, by_itself=by_itself)
        if not names_of:
            return count
        gone, end_s = [], time.monotonic() + DELETE_S
        while names_of and len(gone) < CHUNK and (not gone or time.monotonic() < end_s):
            sequence, artifacts = names_of.popitem()
            _delete(store, job_id, artifacts)
            gone.append(sequence)


def take_back(session: Session, store: ArtifactStore, job_id: str, found: Sequence[Finding], *, by_itself: bool) -> int:
    """Take back the done tasks of a few findings, their artifacts first, and let the tasks that need them wait.

    Parameters
    ----------
    by_itself
        True if the farm repairs by itself, which it does `REPAIRS_ALLOWED` times a task; a user may do so at any time.
    """
    names_of = _artifacts_to_delete(session, job_id, found)
    for artifacts in names_of.values():
        _delete(store, job_id, artifacts)
    return _reset(session, job_id, list(names_of), by_itself=by_itself)


def _artifacts_to_delete(session: Session, job_id: str, found: Sequence[Finding]) -> dict[int, set[str]]:
    """Return what must go by the done task that made it: its damaged artifacts, and the one that says that it is done.

    Without the latter, a worker makes all of them again.
    """
    done = task_rows.numbered(session, job_id, {each.sequence for each in found}, status=TaskStatus.DONE)
    names_of = {task.sequence: {task.artifact} for task in done}
    for each in found:
        if each.sequence in names_of:
            names_of[each.sequence].add(each.artifact)
    return names_of


def _delete(store: ArtifactStore, job_id: str, artifacts: Collection[str]) -> None:
    for name in sorted(artifacts):
        store.delete(names.job_artifact(job_id, name))


def _reset(session: Session, job_id: str, sequences: Sequence[int], *, by_itself: bool) -> int:
    """Let done tasks run again, and those that need them wait; return the number of tasks that were done."""
    done = task_rows.numbered(session, job_id, sequences, status=TaskStatus.DONE)
    if not done:
        return 0
    # The CPU time was spent all the same. Pixels and wall time are subtracted together, since the estimate of the time
    # left divides one by the other.
    gains = {
        "frames_done": -sum(task.kind is TaskKind.ASSEMBLE for task in done),
        "done_px": -sum(task.weight_px for task in done),
        "wall_s": -sum(task.wall_s or 0.0 for task in done),
        "cache_hits": -sum(task.cached for task in done),
        "cached_px": -sum(task.weight_px for task in done if task.cached),
        "artifact_bytes": -sum(task.stored_bytes for task in done),
    }
    add_to_counters(session, {job_id: gains})
    again = [task.sequence for task in done]
    repairs = Task.repairs + 1 if by_itself else 0
    transition_tasks(session, job_id, again, TaskStatus.DONE, TaskStatus.READY, **_RESET, repairs=repairs)
    blocked = task_rows.blocked(session, job_id, {task.stage for task in done}, again)
    transition_tasks(session, job_id, blocked, TaskStatus.READY, TaskStatus.WAITING)
    publish_frames(session, job_id, {task.frame for task in done if task.frame is not None})
    return len(done)


def _is_repaired(row: Job) -> bool:
    return row.status in REPAIRED_IN and row.background_job is None


def find_maker(session: Session, job: Job, name: str) -> Task | None:
    """Return the task that makes an artifact, with its digests; None if no task of the job makes it."""
    maker = maker_of(job.parsed_spec, name)
    if maker is None:
        return None
    return task_rows.made_by(session, job.id, maker.kind, frame=maker.frame, tile=maker.tile, output=maker.output)


def _suspects(database: Database, spec: JobSpec, failed: Task) -> Iterator[Sequence[Task]]:
    """Yield the done tasks whose artifacts a failure may be about, in pages."""
    job_id = failed.job_id
    with database.reading() as session:
        if failed.error_artifact is not None:
            maker = find_maker(session, find_job(session, job_id), failed.error_artifact)
            yield [maker] if maker is not None and maker.status is TaskStatus.DONE else []
            return
        if failed.kind is TaskKind.ASSEMBLE:
            yield task_rows.done_renders(session, job_id, [failed.frame])
            return
    after = -1
    while failed.kind is TaskKind.ENCODE:
        with database.reading() as session:
            page = task_rows.done_assemblies(session, job_id, after=after)
        if not page:
            return
        yield [task for task in page if failed.error_frame in (None, task.frame)]
        after = page[-1].sequence


def _damage(store: ArtifactStore, spec: JobSpec, suspects: Sequence[Task], failed: Task) -> Iterator[Finding]:
    found = list(verify_tasks(store, spec, suspects))
    yield from found
    if failed.error_code != ArtifactBroken.code:
        return
    damaged = {each.artifact for each in found}
    for task in suspects:
        for name in _unproven(spec, task, failed.error_artifact) - damaged:
            message = failed.error_message or f"{name}: cannot be read"
            yield Finding(task.job_id, task.sequence, name, Damage.CONTENT, message)


def _unproven(spec: JobSpec, task: Task, named: str | None) -> set[str]:
    """Return the artifacts of a task whose digests are unknown, only the one that a failure names if it names one."""
    expected = expected_artifacts(spec, task)
    return {name for name, digest in expected.items() if digest is None and named in (None, name)}
