"""Queries on what owners have stored: the bytes of artifacts, counted with the tasks, and the bundles of scenes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from sqlalchemy import bindparam, func, or_, select, text
from sqlalchemy.orm import Session

from lippmann.job.states import JobStatus, PausedBy
from service.db.tables import Job, OwnerUsage, StoredBundle
from service.errors import StorageQuotaExceeded

_ADD = text(
    "INSERT INTO owner_usage (owner_id, artifact_bytes) "
    "SELECT owner_id, CAST(:added AS BIGINT) FROM jobs WHERE id = :of_job "
    "ON CONFLICT (owner_id) DO UPDATE SET artifact_bytes = owner_usage.artifact_bytes + excluded.artifact_bytes"
)
_STORED = select(OwnerUsage.owner_id, OwnerUsage.artifact_bytes).where(
    OwnerUsage.owner_id.in_(bindparam("owner_ids", expanding=True))
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


def has_bundle(session: Session, owner_id: str, digest: str) -> bool:
    """Return whether an owner has stored a bundle."""
    return session.get(StoredBundle, (owner_id, digest)) is not None


def add_bundle(session: Session, owner_id: str, digest: str, size: int) -> None:
    """Count a bundle as stored by an owner, once."""
    session.merge(StoredBundle(owner_id=owner_id, digest=digest, bytes=size))
