"""The use of a farm by an owner, with the limits of the farm and of a key."""

from __future__ import annotations

from sqlalchemy.orm import Session

from service.auth import Caller
from service.db import jobs as job_rows
from service.db import usage as usage_rows
from service.limits import MEGABYTE, Limits
from service.schemas.access import KeyLimits
from service.schemas.usage import Usage, UsageItem
from service.settings import Settings


def usage_of(session: Session, caller: Caller, settings: Settings) -> Usage:
    """Return what the owner of a caller uses, and the limits of the caller. The tasks of the farm are not counted."""
    limits, used = Limits(settings, caller.limits), _used(session, caller.owner_id)
    items = []
    for name in KeyLimits.model_fields:
        limit = limits[name]
        items.append(UsageItem(name=name, used=used.get(name), limit=limit.value, source=limit.source))
    return Usage(owner_id=caller.owner_id, items=tuple(items))


def _used(session: Session, owner_id: str) -> dict[str, float]:
    jobs, frames = job_rows.open_of(session, owner_id)
    bundles, bundle_bytes = usage_rows.bundles(session, owner_id)
    return {
        "open_jobs": jobs,
        "open_frames": frames,
        "slots": sum(count for (owner, _), count in job_rows.outstanding(session).items() if owner == owner_id),
        "scenes": usage_rows.scene_count(session, owner_id),
        "bundles": bundles,
        "bundles_mb": bundle_bytes / MEGABYTE,
        "artifacts_mb": usage_rows.artifact_bytes(session, [owner_id]).get(owner_id, 0) / MEGABYTE,
    }
