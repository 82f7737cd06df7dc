"""Takes away what removed jobs left: logs that a stopped attempt stored when its job was already gone.

Only folders without a `job.json` and without a row go. Whatever still has its `job.json` stays, so that a database that
was lost, or brought back from an old copy, never costs pictures.
"""

from __future__ import annotations

from lippmann.plan import artifact_names as names
from service.db import orphans as sweep_rows
from service.db.engine import Database
from service.ids import is_job_id
from service.ports import ArtifactStore

ORPHAN_S = 3600.0
"""How long artifacts without a job are left alone: a stopped attempt has stored its log long before."""


def sweep_orphans(database: Database, store: ArtifactStore, *, now_s: float, older_than_s: float = ORPHAN_S) -> int:
    """Delete what removed jobs left; returns of how many jobs.

    Slow on a large store, and holds neither a connection nor the writer while it asks the store.
    """
    swept = 0
    for folder in store.folders():
        if is_job_id(folder) and _is_orphan(database, store, folder, now_s - older_than_s):
            store.delete(names.job_artifact(folder, ""))
            swept += 1
    return swept


def _is_orphan(database: Database, store: ArtifactStore, job_id: str, before_s: float) -> bool:
    if store.exists(names.job_artifact(job_id, names.JOB_SHEET)) or _has_row(database, job_id):
        return False
    # An empty folder is one that an artifact is just being put into.
    found = store.list(job_id)
    return bool(found) and all(info.modified_s < before_s for info in found) and not _has_row(database, job_id)


def _has_row(database: Database, job_id: str) -> bool:
    with database.reading() as session:
        return sweep_rows.is_job(session, job_id)
