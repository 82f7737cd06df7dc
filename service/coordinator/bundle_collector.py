"""The collector of scene bundles deletes those that were replaced and that no job needs any more.

A job needs its bundle as long as it has a row: a retry or a repair renders with it again. A bundle is deleted only
after it was needed by nobody for `UNUSED_S`, because a job that is being submitted has no row yet.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field

import structlog

from lippmann.errors import ArtifactMissing
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore
from service.db import jobs as job_rows
from service.db import usage as usage_rows
from service.db.engine import Database

UNUSED_S = 3600.0
"""The time for which nobody needed a bundle before it is deleted; a submission takes seconds."""
CHUNK = 100
"""The number of jobs of an earlier release that are read before the next transaction."""

log = structlog.get_logger("service.bundle_collector")


@dataclass
class BundleCollector:
    """Deletes bundles that nobody needs; it remembers since when each has been unused."""

    database: Database
    store: ArtifactStore
    _unused_since_s: dict[str, float] = field(default_factory=dict)

    def begin(self) -> None:
        """Begin as a new leader: what was unused once may have been needed since."""
        self._unused_since_s = {}

    def run(self, *, now_s: float) -> int:
        """Delete the bundles that were unused for long, and return their number."""
        while self._read_bundles():
            pass
        with self.database.reading() as session:
            unused = usage_rows.unused_bundles(session)
        self._unused_since_s = {digest: self._unused_since_s.get(digest, now_s) for digest in unused}
        old = [digest for digest, since_s in self._unused_since_s.items() if now_s - since_s >= UNUSED_S]
        return sum(self._delete(digest) for digest in old)

    def _delete(self, digest: str) -> bool:
        with self.database.writing() as session:
            if not usage_rows.forget_bundle(session, digest):
                return False
            # Inside the transaction: an upload of the same bundle stores it after its own transaction, which waits.
            self.store.delete(names.bundle_name(digest))
        log.info("a scene bundle that nobody needs was deleted", bundle=digest)
        return True

    def _read_bundles(self) -> bool:
        """Note the bundles of some jobs of an earlier release; return whether there may be more."""
        with self.database.reading() as session:
            job_ids = job_rows.without_bundle(session, limit=CHUNK)
        found = {job_id: self._bundle_of(job_id) for job_id in job_ids}
        with self.database.writing() as session:
            job_rows.set_bundles(session, found)
        return len(job_ids) == CHUNK

    def _bundle_of(self, job_id: str) -> str:
        """Return the bundle that a job file names; empty for a job without its file, which cannot be rendered."""
        try:
            sheet = json.loads(self.store.get_bytes(names.job_artifact(job_id, names.JOB_FILE)))
            return str(sheet["bundle"])[:64]
        except (ArtifactMissing, ValueError, LookupError, TypeError):
            return ""
