"""Invariants of the coordinator's row, of attempts that it watches, and of stop requests."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from lippmann.job.states import HELD_TASKS, TaskStatus
from service.db import coordinator as coordinator_rows
from service.db.tables import CoordinatorRow, StopRequest, Task, WebhookDelivery
from service.doctor.finding import Check, Finding, Level, tasks_text
from service.settings import Settings

SILENT_FACTOR = 3.0
"""An attempt that is silent for this many times `lease_ttl_s` while a leader is alive should have been noticed."""
STOP_S = 600.0
"""The time after which a stop request should have reached the broker."""

WEBHOOK_S = 3600.0
"""The time after which a webhook that is due should have been tried."""


def check_farm(session: Session, settings: Settings, *, now_s: float) -> Iterator[Finding]:
    """Yield what is wrong with the coordinator's row, with attempts and with stop requests."""
    rows = session.scalars(select(CoordinatorRow)).all()
    if len(rows) != 1:
        message = f"expected one row of the coordinator, got {len(rows)}"
        yield Finding(Check.COORDINATOR, Level.ERROR, message, repairable=not rows)
        return
    (row,) = rows
    left_s = row.leader_until_s - coordinator_rows.clock_s(session, local_s=now_s)
    if left_s > 2 * settings.leader_ttl_s:
        message = (
            f"the leader {row.leader} is in office for another {left_s:.0f} s, because a clock was "
            "set; no other process can lead until then"
        )
        yield Finding(Check.LEADER, Level.ERROR, message, repairable=True)
    yield from _check_idle_clock(session, row)
    if row.leader is not None and left_s >= 0:
        yield from _check_watched(session, settings, now_s)


def _check_idle_clock(session: Session, row: CoordinatorRow) -> Iterator[Finding]:
    query = select(Task.job_id, Task.sequence).where(Task.status == TaskStatus.DISPATCHED)
    by_job: dict[str, list[int]] = defaultdict(list)
    for job_id, sequence in session.execute(query.where(Task.dispatched_idle_s > row.idle_s)):
        by_job[job_id].append(sequence)
    for job_id, sequences in by_job.items():
        message = (
            f"{tasks_text(sequences)} were dispatched later than the idle clock says, so they are never taken back"
        )
        yield Finding(Check.IDLE_CLOCK, Level.ERROR, message, job_id, tuple(sequences), repairable=True)


def _check_watched(session: Session, settings: Settings, now_s: float) -> Iterator[Finding]:
    latest_s = now_s - SILENT_FACTOR * settings.lease_ttl_s
    query = select(func.count()).where(Task.status.in_(HELD_TASKS), Task.heartbeat_s < latest_s)
    if silent := session.scalar(query):
        message = f"{silent} attempts have been silent for long; the broker may be unavailable"
        yield Finding(Check.SILENT, Level.WARNING, message)
    if pending := session.scalar(select(func.count()).where(StopRequest.requested_s < now_s - STOP_S)):
        message = f"{pending} stop requests have not reached the broker for more than {STOP_S:.0f} s"
        yield Finding(Check.STOPS, Level.WARNING, message)
    if overdue := session.scalar(select(func.count()).where(WebhookDelivery.next_s < now_s - WEBHOOK_S)):
        message = f"{overdue} webhooks have been due for more than {WEBHOOK_S:.0f} s; their receivers may be slow"
        yield Finding(Check.WEBHOOKS, Level.WARNING, message)
