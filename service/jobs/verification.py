"""Verification of artifacts: whether what done tasks stored is still there and whole.

An artifact is whole if its size and SHA-256 are those that its task reported. Tasks that were done before tasks
reported digests, or whose report was lost, have none: their artifacts must exist and must not be empty.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from sqlalchemy.orm import Session

from lippmann.digest import Digest, digest_of
from lippmann.errors import ArtifactMissing
from lippmann.job.messages.orders import TaskKind
from lippmann.job.spec import JobSpec
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore
from lippmann.plan.makers import artifacts_of
from service.db import tasks as task_rows
from service.db.engine import Database
from service.db.tables import Task
from service.db.task_state import TaskState
from service.jobs.state_machine import find_job


class Damage(StrEnum):
    """The kind of damage of an artifact."""

    MISSING = "missing"
    SIZE = "size"
    CONTENT = "content"


@dataclass(frozen=True)
class Finding:
    """An artifact of a done task that is missing or damaged."""

    job_id: str
    sequence: int
    """The task that makes the artifact."""
    artifact: str
    """The name below the job."""
    damage: Damage
    message: str
    """A sentence with the expected and the actual size or digest."""


def verify_job(database: Database, store: ArtifactStore, job_id: str) -> Iterator[Finding]:
    """Yield the artifacts of a job that are missing or damaged; this reads all of them.

    No connection is held while the store is read.

    Raises
    ------
    NotFound
        If the job does not exist.
    """
    with database.reading() as session:
        spec = find_job(session, job_id).parsed_spec
    for page in done_pages(database, job_id):
        yield from verify_tasks(store, spec, page)


def verify_tasks(store: ArtifactStore, spec: JobSpec, tasks: Sequence[Task]) -> Iterator[Finding]:
    """Yield the artifacts of done tasks, with their digests loaded, that are missing or damaged."""
    for task in tasks:
        for name, expected in expected_artifacts(spec, task).items():
            found = examine(store, task.job_id, name, expected)
            if found is not None:
                yield Finding(task.job_id, task.sequence, name, *found)


def examine(
    store: ArtifactStore, job_id: str, name: str, expected: Digest | None, *, by_content: bool = True
) -> tuple[Damage, str] | None:
    """Return the damage of an artifact and a sentence about it; None if it is whole.

    Parameters
    ----------
    name
        The name below the job.
    expected
        The digest that its task reported; None if it is unknown.
    by_content
        False to compare only the size, which reads nothing.
    """
    full_name = names.job_artifact(job_id, name)
    try:
        size = store.size(full_name)
        wrong = size_damage(name, size, expected)
        if wrong is not None:
            return Damage.SIZE, wrong
        if expected is None:
            return None
        found = digest_of(store.read_range(full_name, 0, size)) if by_content else expected
    except ArtifactMissing:
        return Damage.MISSING, f"{name}: expected an artifact, got nothing there"
    if found != expected:
        return Damage.CONTENT, f"{name}: expected the SHA-256 {expected.sha256}, got {found.sha256}"
    return None


def size_damage(name: str, size: int, expected: Digest | None) -> str | None:
    """Return a sentence about an artifact that has another size than its task reported; None if the size is right."""
    if expected is None:
        return None if size else f"{name}: expected some bytes, got an empty file"
    return None if size == expected.size else f"{name}: expected {expected.size} bytes, got {size}"


def expected_artifacts(spec: JobSpec, task: Task) -> dict[str, Digest | None]:
    """Return the artifacts that a done task stored, with their digests where these are known."""
    known = reported(task)
    made = artifacts_of(spec, task.kind, frame=task.frame, tile=task.tile, artifact=task.artifact)
    return {**dict.fromkeys(made), **known}


def reported(task: Task) -> dict[str, Digest]:
    """Return the digests that a task reported, by the names of its artifacts below the job."""
    return _parsed(task.digests)


def _parsed(digests: Mapping[str, Any] | None) -> dict[str, Digest]:
    return {name: Digest(*pair) for name, pair in (digests or {}).items()}


def input_digests(session: Session, tasks: Sequence[TaskState]) -> Mapping[tuple[str, int], dict[str, Digest]]:
    """Return the digests of what tasks read, by (job, sequence): the tiles of an assembly, the masters of an output."""
    found: dict[tuple[str, int], dict[str, Digest]] = {}
    for job_id in {task.job_id for task in tasks}:
        mine = [task for task in tasks if task.job_id == job_id]
        assemblies = [task for task in mine if task.kind is TaskKind.ASSEMBLE]
        outputs = [task for task in mine if task.kind is TaskKind.ENCODE]
        if assemblies:
            by_frame: dict[int | None, dict[str, Digest]] = {}
            for frame, digests in task_rows.render_digests(session, job_id, [task.frame for task in assemblies]):
                by_frame.setdefault(frame, {}).update(_parsed(digests))
            found |= {(job_id, task.sequence): by_frame.get(task.frame, {}) for task in assemblies}
        if outputs:
            masters = dict(_masters_of_outputs(session, job_id))
            found |= {(job_id, task.sequence): masters for task in outputs}
    return found


def _masters_of_outputs(session: Session, job_id: str) -> Iterator[tuple[str, Digest]]:
    """Yield the masters that outputs are made from: orthoscopic integral images, depth maps and other channels."""
    for digests in task_rows.digests_of_assemblies(session, job_id):
        for name, pair in digests.items():
            if name.startswith(("orthoscopic/", "depth/", "channels/")):
                yield name, Digest(*pair)


def done_pages(database: Database, job_id: str, *, after: int = -1) -> Iterator[Sequence[Task]]:
    """Yield the done tasks of a job in pages, with their digests."""
    while True:
        with database.reading() as session:
            page = task_rows.done_page(session, job_id, after=after)
        if not page:
            return
        yield page
        after = page[-1].sequence
