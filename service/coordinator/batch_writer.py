"""Writes a batch of changes by a handful of statements, whatever the number of its tasks and jobs."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from sqlalchemy.orm import Session

from service.coordinator.event_rules import Batch
from service.coordinator.retry_policy import Fault
from service.db import coordinator as coordinator_rows
from service.db import faults as fault_rows
from service.db import jobs as job_rows
from service.events.publish import publish_progress
from service.jobs.completion import settle
from service.jobs.state_machine import write_drafts
from service.jobs.storage_quota import pause_beyond_quota
from service.settings import Settings


def write_batch(session: Session, batch: Batch) -> None:
    """Write the changes of a batch; the touched jobs are closed afterwards, by `close_jobs`."""
    coordinator_rows.request_stop(session, batch.stops, now_s=batch.now_s)
    job_rows.set_probes(session, {job_id: probe.model_dump() for job_id, probe in batch.probes.items()})
    write_drafts(session, batch.drafts.values(), now_s=batch.now_s, late=batch.late)
    job_rows.request_repairs(session, batch.suspicious)
    _write_faults(session, batch.faults, now_s=batch.now_s, settings=batch.settings)


def close_jobs(session: Session, job_ids: Collection[str], *, now_s: float, settings: Settings) -> None:
    """End those jobs whose tasks have ended, pause those beyond a quota, and publish the progress of the others."""
    rows = job_rows.jobs(session, job_ids)
    running = [row for row in rows if not settle(session, row, now_s=now_s, limit=settings.failure_limit)]
    pause_beyond_quota(session, running, now_s=now_s, settings=settings)
    publish_progress(session, running)


def _write_faults(session: Session, faults: Iterable[Fault], *, now_s: float, settings: Settings) -> None:
    pairs = {(fault.job_id, fault.worker) for fault in faults}
    known = fault_rows.faults(session, pairs)
    for fault in faults:
        row = known[fault.job_id, fault.worker]
        if fault.prevention is not None:
            prevention = fault.prevention
            row.avoided_until_s, row.code, row.message = prevention.until_s, prevention.code, prevention.message
            continue
        row.failures += 1
        if row.failures >= settings.avoid_after:
            row.failures, row.avoided_until_s = 0, now_s + settings.avoid_s
    session.flush()
