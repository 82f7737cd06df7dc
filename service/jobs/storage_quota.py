"""The quota of stored artifacts: jobs of an owner who has used it up are paused, and go on when there is room.

The bytes of artifacts are counted by owner when tasks are done, and when jobs are removed. The artifacts that running
tasks store after their owner has crossed the limit are beyond it.
"""

from __future__ import annotations

from collections.abc import Iterable

from sqlalchemy.orm import Session

from lippmann.errors import FieldProblem
from service.db import jobs as job_rows
from service.db import usage as usage_rows
from service.db.engine import Database
from service.db.tables import Job
from service.errors import StorageQuotaExceeded
from service.jobs.farm_pause import pause_for_farm, resume_for_farm
from service.limits import MEGABYTE, Limits
from service.schemas.access import KeyLimits
from service.settings import Settings


def check_storage(session: Session, owner_id: str, *, limits: Limits) -> None:
    """Refuse more work for an owner whose artifacts are larger than the limits allow.

    Raises
    ------
    StorageQuotaExceeded
        If they are. Waiting does not help, so the error has no time.
    """
    limit, stored_mb = limits["artifacts_mb"], stored_by(session, owner_id)
    if stored_mb > limit.value:
        problem = FieldProblem(field="artifacts_mb", expected=str(limit), got=f"{stored_mb:.15g}")
        message = f"the artifacts of {owner_id!r} have {stored_mb:.15g} MB, expected {limit}; remove jobs"
        raise StorageQuotaExceeded(message, problems=[problem])


def stored_by(session: Session, owner_id: str) -> float:
    """Return the size of the artifacts of an owner in megabytes."""
    return usage_rows.artifact_bytes(session, [owner_id]).get(owner_id, 0) / MEGABYTE


def pause_beyond_quota(session: Session, rows: Iterable[Job], *, now_s: float, settings: Settings) -> None:
    """Pause those jobs whose owners have stored more artifacts than the limits allow; running tasks finish."""
    at_work = [row for row in rows if row.status in job_rows.WORKABLE]
    stored = usage_rows.artifact_bytes(session, {row.owner_id for row in at_work}) if at_work else {}
    for row in at_work:
        limit = Limits(settings, KeyLimits(artifacts_mb=row.max_artifacts_mb))["artifacts_mb"]
        stored_mb = stored.get(row.owner_id, 0) / MEGABYTE
        if stored_mb > limit.value:
            reason = f"The artifacts of its owner have {stored_mb:.15g} MB, expected {limit}. Removed jobs make room."
            pause_for_farm(session, row, code=StorageQuotaExceeded.code, reason=reason, now_s=now_s)


def resume_within_quota(database: Database, *, now_s: float, settings: Settings) -> int:
    """Let those jobs go on that `pause_beyond_quota` paused and that have room now; return their number."""
    with database.reading() as session:
        job_ids = usage_rows.resumable(session, max_artifacts_mb=settings.max_artifacts_mb)
    for job_id in job_ids:
        with database.writing() as session:
            row = job_rows.job(session, job_id)
            if row is not None and row.pause_code == StorageQuotaExceeded.code:
                resume_for_farm(session, row, is_repaired=False, now_s=now_s, limit=settings.failure_limit)
    return len(job_ids)
