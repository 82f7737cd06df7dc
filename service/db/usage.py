"""Queries on what owners have stored: the bytes of artifacts, counted with the tasks, and the bundles of scenes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from sqlalchemy import bindparam, delete, func, or_, select, text, update
from sqlalchemy.orm import Session

from lippmann.job.states import JobStatus, PausedBy
from service.db.engine import changed
from service.db.tables import BackgroundJob, Job, OwnerUsage, Scene, StoredBundle, Task
from service.errors import StorageQuotaExceeded

_ADD = text(
    "INSERT INTO owner_usage (owner_id, artifact_bytes) "
    "SELECT owner_id, CAST(:added AS BIGINT) FROM jobs WHERE id = :of_job "
    "ON CONFLICT (owner_id) DO UPDATE SET artifact_bytes = owner_usage.artifact_bytes + excluded.artifact_bytes"
)
_STORED = select(OwnerUsage.owner_id, OwnerUsage.artifact_bytes).where(
    OwnerUsage.owner_id.in_(bindparam("owner_ids", expanding=True))
)
_OF_TASKS = select(Task.job_id, func.sum(Task.stored_bytes).label("right")).group_by(Task.job_id).subquery()
_UNUSED = (
    ~select(Scene.name).where(Scene.digest == StoredBundle.digest).exists(),
    ~select(Job.id).where(Job.bundle == StoredBundle.digest).exists(),
)
_USED = func.coalesce(OwnerUsage.artifact_bytes, 0)
_RESUMABLE = (
    select(Job.id)
    .outerjoin(OwnerUsage, OwnerUsage.owner_id == Job.owner_id)
    .where(Job.status == JobStatus.PAUSED, Job.paused_by == PausedBy.FARM)
    .where(Job.pause_code == StorageQuotaExceeded.code, bindparam("most_bytes") >= _USED)
    .where(or_(Job.max_artifacts_mb.is_(None), Job.max_artifacts_mb * 1_000_000 >= _USED))
    .order_by(Job.id)
)


def add_artifact_bytes(session: Session, added: Mapping[str, int]) -> None:
    """Add bytes of artifacts to the owners of jobs, by job, with one statement."""
    rows = [{"of_job": job_id, "added": count} for job_id, count in sorted(added.items()) if count]
    if rows:
        session.connection().execute(_ADD, rows)


def artifact_bytes(session: Session, owner_ids: Iterable[str]) -> dict[str, int]:
    """Return the bytes of the artifacts of owners; one who has stored none is left out."""
    return dict(session.execute(_STORED, {"owner_ids": sorted(owner_ids)}).all())


def resumable(session: Session, *, max_artifacts_mb: int) -> Sequence[str]:
    """Return the jobs that wait for room for artifacts and have it."""
    return session.scalars(_RESUMABLE, {"most_bytes": max_artifacts_mb * 1_000_000}).all()


def bundles(session: Session, owner_id: str) -> tuple[int, int]:
    """Return the number of the bundles that an owner has stored, and their bytes."""
    query = select(func.count(), func.coalesce(func.sum(StoredBundle.bytes), 0))
    count, stored = session.execute(query.where(StoredBundle.owner_id == owner_id)).one()
    return int(count), int(stored)


def miscounted_jobs(session: Session) -> Sequence[tuple[str, int, int]]:
    """Return the jobs whose bytes are not those of their tasks: id, stored, right. Jobs being removed are left out."""
    right = func.coalesce(_OF_TASKS.c.right, 0)
    query = select(Job.id, Job.artifact_bytes, right).outerjoin(_OF_TASKS, _OF_TASKS.c.job_id == Job.id)
    query = query.where(Job.background_job.is_distinct_from(BackgroundJob.REMOVE), Job.artifact_bytes != right)
    return [(job_id, stored, int(count)) for job_id, stored, count in session.execute(query.order_by(Job.id))]


def miscounted_owners(session: Session) -> Sequence[tuple[str, int, int]]:
    """Return the owners whose bytes are not those of their jobs: id, stored, right."""
    jobs = dict(session.execute(select(Job.owner_id, func.sum(Job.artifact_bytes)).group_by(Job.owner_id)).all())
    stored = dict(session.execute(select(OwnerUsage.owner_id, OwnerUsage.artifact_bytes)).all())
    counts = [(owner, stored.get(owner, 0), int(jobs.get(owner, 0))) for owner in sorted(jobs.keys() | stored.keys())]
    return [count for count in counts if count[1] != count[2]]


def recount_job(session: Session, job_id: str) -> None:
    """Set the bytes of a job from its tasks; `recount_owners` then sets those of its owner."""
    right = select(func.coalesce(func.sum(Task.stored_bytes), 0)).where(Task.job_id == job_id).scalar_subquery()
    changed(session, update(Job).where(Job.id == job_id).values(artifact_bytes=right))


def recount_owners(session: Session) -> None:
    """Set the bytes of all owners from their jobs."""
    for owner_id, _, right in miscounted_owners(session):
        session.merge(OwnerUsage(owner_id=owner_id, artifact_bytes=right))
    session.flush()


def scene_count(session: Session, owner_id: str) -> int:
    """Return the number of the scenes of an owner."""
    query = select(func.count()).where(Scene.owner_id == owner_id, Scene.builtin.is_(False))
    return session.scalar(query) or 0


def unused_bundles(session: Session) -> Sequence[str]:
    """Return the bundles that no scene and no job needs; none while the bundle of some job is not known."""
    unknown = select(Job.id).where(Job.bundle.is_(None)).limit(1)
    if session.execute(unknown).first() is not None:
        return ()
    return session.scalars(select(StoredBundle.digest).where(*_UNUSED).distinct()).all()


def forget_bundle(session: Session, digest: str) -> bool:
    """Count a bundle no more, unless somebody needs it; return whether it was forgotten."""
    return changed(session, delete(StoredBundle).where(StoredBundle.digest == digest, *_UNUSED)) > 0


def has_bundle(session: Session, owner_id: str, digest: str) -> bool:
    """Return whether an owner has stored a bundle."""
    return session.get(StoredBundle, (owner_id, digest)) is not None


def add_bundle(session: Session, owner_id: str, digest: str, size: int) -> None:
    """Count a bundle as stored by an owner, once."""
    session.merge(StoredBundle(owner_id=owner_id, digest=digest, bytes=size))
