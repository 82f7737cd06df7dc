"""Deletes the artifacts that removed jobs left: logs that a stopped attempt stored after its job was removed.

Only folders without a `job.json` and without a row are deleted. A folder with its `job.json` stays, so that a database
that was lost or restored from an old backup never costs pictures.
"""

from __future__ import annotations

from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore
from service.db import jobs as job_rows
from service.db.engine import Database
from service.ids import is_job_id

ORPHAN_S = 3600.0
"""The age below which artifacts without a job are kept; a stopped attempt stores its log long before."""


def sweep_orphans(database: Database, store: ArtifactStore, *, now_s: float, older_than_s: float = ORPHAN_S) -> int:
    """Delete the artifacts that removed jobs left, and return the number of these jobs.

    The sweep is slow on a large store. It holds neither a connection nor the writer while it reads the store.
    """
    swept = 0
    for folder in store.folders():
        if is_job_id(folder) and _is_orphan(database, store, folder, now_s - older_than_s):
            store.delete(names.job_artifact(folder, ""))
            swept += 1
    return swept


def _is_orphan(database: Database, store: ArtifactStore, job_id: str, before_s: float) -> bool:
    if store.exists(names.job_artifact(job_id, names.JOB_FILE)) or _has_row(database, job_id):
        return False
    # An artifact is about to be stored in an empty folder.
    found = store.list(job_id)
    return bool(found) and all(info.modified_s < before_s for info in found) and not _has_row(database, job_id)


def _has_row(database: Database, job_id: str) -> bool:
    with database.reading() as session:
        return job_rows.has_row(session, job_id)
