"""The artifact store: artifacts of done tasks, bundles of scenes, orphans, partial files and space."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import select

from lippmann.errors import StoreUnavailable
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore, LeavesPartialFiles
from service.coordinator.orphan_sweeper import ORPHAN_S
from service.db import jobs as job_rows
from service.db.engine import Database
from service.db.tables import Job, Scene
from service.doctor.finding import Check, Finding, Level
from service.errors import NotFound
from service.ids import is_job_id
from service.jobs.artifact_repair import REPAIRED_IN
from service.jobs.state_machine import find_job
from service.jobs.verification import done_pages, examine, expected_artifacts
from service.store_check import StoreCheck
from service.store_identity import known_identity

LITTLE_BYTES = 1_000_000_000
TOO_LITTLE_BYTES = 100_000_000
"""The free space with which `lippmann up` does not start."""
PARTIAL_S = 86_400.0
"""The age at which a partial file was left by a process that died; no upload takes that long."""
SHOWN = 3
"""The number of damaged artifacts that a message shows."""


def check_store(database: Database, store: ArtifactStore, *, by_content: bool, now_s: float) -> Iterator[Finding]:
    """Yield what is missing in the store, what is damaged, and what should not be there.

    Parameters
    ----------
    by_content
        True to read every artifact and compare its digest; False to compare sizes only.
    """
    store.expect(known_identity(database))
    try:
        yield from _check_space(store)
        yield from _check_bundles(database, store)
        for job_id in _job_ids(database):
            yield from check_artifacts(database, store, job_id, by_content=by_content)
        yield from _check_orphans(database, store, now_s)
    except StoreUnavailable as error:
        lost = "if this is the new store of a farm whose old one is lost, use `lippmann doctor --adopt-store`"
        yield Finding(Check.STORE, Level.ERROR, f"the store does not answer: {error}; {lost}")
    if isinstance(store, LeavesPartialFiles) and (count := store.count_partial(PARTIAL_S)):
        message = f"{count} partial files of processes that died are older than a day"
        yield Finding(Check.PARTIAL_FILES, Level.WARNING, message, repairable=True)


def check_way_to_store(store: ArtifactStore) -> Iterator[Finding]:
    """Yield what is wrong with a store for a worker, which does not know its id: a small file is stored and deleted."""
    try:
        identity = store.identity()
    except StoreUnavailable as error:
        yield Finding(Check.STORE, Level.ERROR, f"the store does not answer: {error}")
        return
    if identity is None:
        text = "the store has no id: it is not that of a farm, or its service has not started yet"
        yield Finding(Check.STORE, Level.WARNING, text)
        return
    refused = StoreCheck(store, reserve_bytes=0).error()
    if refused is not None:
        yield Finding(Check.STORE, Level.ERROR, refused.message)
        return
    yield Finding(Check.STORE, Level.NOTE, f"the store takes artifacts, and has the id {identity}")


def check_artifacts(database: Database, store: ArtifactStore, job_id: str, *, by_content: bool) -> Iterator[Finding]:
    """Yield one finding if artifacts of done tasks of a job are missing or damaged."""
    try:
        with database.reading() as session:
            row = find_job(session, job_id)
            spec, status = row.parsed_spec, row.status
        damaged: dict[int, str] = {}
        count = 0
        for page in done_pages(database, job_id):
            for task in page:
                for name, digest in expected_artifacts(spec, task).items():
                    if found := examine(store, job_id, name, digest, by_content=by_content):
                        damaged.setdefault(task.sequence, found[1])
                        count += 1
        if damaged:
            with database.reading() as session:
                find_job(session, job_id)
    except NotFound:
        return  # The job was removed while its artifacts were examined.
    if damaged:
        shown = "; ".join(list(damaged.values())[:SHOWN])
        message = f"{count} artifacts of {len(damaged)} done tasks are missing or damaged: {shown}"
        repairable = status in REPAIRED_IN
        if not repairable:
            message = f"{message}; the job is {status}, and `lippmann repair {job_id}` makes them again"
        yield Finding(Check.ARTIFACTS, Level.ERROR, message, job_id, tuple(damaged), repairable=repairable)


def _job_ids(database: Database) -> list[str]:
    with database.reading() as session:
        return list(session.scalars(select(Job.id).where(Job.background_job.is_(None)).order_by(Job.id)))


def _check_space(store: ArtifactStore) -> Iterator[Finding]:
    free = store.free_bytes()
    if free is not None and free < LITTLE_BYTES:
        level = Level.ERROR if free < TOO_LITTLE_BYTES else Level.WARNING
        yield Finding(Check.SPACE, level, f"the store has only {free / 1e6:.0f} MB of free space")


def _check_bundles(database: Database, store: ArtifactStore) -> Iterator[Finding]:
    with database.reading() as session:
        scenes = session.execute(select(Scene.name, Scene.digest, Scene.builtin)).all()
    for name, digest, is_builtin in scenes:
        if not store.exists(names.bundle_name(digest)):
            then = "the next start stores it again" if is_builtin else "upload the scene again"
            level = Level.WARNING if is_builtin else Level.ERROR
            yield Finding(Check.BUNDLES, level, f"the bundle of the scene {name} is missing; {then}")


def _check_orphans(database: Database, store: ArtifactStore, now_s: float) -> Iterator[Finding]:
    kept, left = [], []
    for folder in filter(is_job_id, store.folders()):
        with database.reading() as session:
            is_known = job_rows.has_row(session, folder)
        if is_known:
            continue
        if store.exists(names.job_artifact(folder, names.JOB_FILE)):
            kept.append(folder)
        elif (found := store.list(folder)) and all(info.modified_s < now_s - ORPHAN_S for info in found):
            left.append(folder)
    if kept:
        message = (
            f"the store has the artifacts of {len(kept)} jobs that the database does not have "
            f"({', '.join(kept[:SHOWN])}); they are kept, because a database may have been lost"
        )
        yield Finding(Check.ORPHANS, Level.NOTE, message)
    if left:
        message = f"the store has artifacts that {len(left)} removed jobs left ({', '.join(left[:SHOWN])})"
        yield Finding(Check.ORPHANS, Level.WARNING, message, repairable=True)
