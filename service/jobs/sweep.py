"""Takes away what nobody owns: artifacts of jobs without a row, and bundles that neither a scene nor a job uses.

The store is written before the rows, and attempts store their logs when the job may already be gone; so what is young
is left alone, and what is old and has no row never gets one.
"""

from __future__ import annotations

from collections.abc import Iterator

from service.db import sweep_rows
from service.db.engine import Database
from service.jobs.ids import is_job_id
from service.parts import ArtifactStore
from worker.errors import ArtifactMissing
from worker.job.sheet import JobSheet
from worker.plan import names

ORPHAN_S = 3600.0
"""How long artifacts without a job are left alone: a stopped attempt has stored its log long before."""
UNUSED_S = 86_400.0
"""How long a bundle that nothing uses is left alone."""


def sweep_orphans(database: Database, store: ArtifactStore, *, now_s: float, older_than_s: float = ORPHAN_S) -> int:
    """Delete the artifacts of jobs that have no row, and bundles that nothing uses; returns how many of both.

    Slow on a large store, and holds neither a connection nor the writer while it asks the store.
    """
    swept = 0
    for folder in store.folders():
        if is_job_id(folder) and _is_orphan(database, store, folder, now_s - older_than_s):
            store.delete(names.job_artifact(folder, ""))
            swept += 1
    unused = _unused(database, store, now_s - max(UNUSED_S, older_than_s))
    for name in unused:
        store.delete(name)
    return swept + len(unused)


def _is_orphan(database: Database, store: ArtifactStore, job_id: str, before_s: float) -> bool:
    if _has_row(database, job_id):
        return False
    # An empty folder is one that an artifact is just being put into.
    found = store.list(job_id)
    return bool(found) and all(info.modified_s < before_s for info in found) and not _has_row(database, job_id)


def _has_row(database: Database, job_id: str) -> bool:
    with database.reading() as session:
        return sweep_rows.is_job(session, job_id)


def _unused(database: Database, store: ArtifactStore, before_s: float) -> set[str]:
    bundles = {info.name for info in store.list("scenes") if info.modified_s < before_s}
    with database.reading() as session:
        unused = {name for name in bundles if not sweep_rows.is_scene(session, _digest_in(name))}
    # Which bundle a job uses stands in its sheet only, and reading all of them is seldom needed.
    sheets = _sheets(database, store) if unused else iter(())
    for sheet in sheets:
        unused.discard(names.bundle_name(sheet.bundle))
        if not unused:
            break
    return unused


def _sheets(database: Database, store: ArtifactStore) -> Iterator[JobSheet]:
    after = ""
    while True:
        with database.reading() as session:
            page = sweep_rows.job_ids(session, after=after)
        if not page:
            return
        for job_id in page:
            try:
                data = store.get_bytes(names.job_artifact(job_id, names.JOB_SHEET))
            except ArtifactMissing:  # a job without its sheet can use nothing
                continue
            yield JobSheet.model_validate_json(data)
        after = page[-1]


def _digest_in(bundle: str) -> str:
    return bundle.removeprefix("scenes/").removesuffix(".zip")
