"""The rows that refer to running processes, which a restored farm does not have."""

from __future__ import annotations

from collections import defaultdict

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from lippmann.job.states import HELD_TASKS, TaskStatus
from service.backup.rows import advance_ids
from service.db.engine import changed
from service.db.tables import AuditRow, CoordinatorRow, JobEvent, StopRequest, Task
from service.jobs.state_machine import transition_tasks

EVENT_GAP = 1_000_000
"""The gap in the ids of events: a subscriber of the farm before, which knows later ids, receives the next event."""


def reset_running(session: Session, *, store_id: str | None) -> int:
    """Take back held tasks, and reset the coordinator; return the number of these tasks.

    The farm takes the store with the id `store_id`; without an id, it takes the store that it finds when it starts.

    An attempt that still runs somewhere no longer owns its task, so its events are late, and it is stopped.
    """
    held = session.execute(select(Task.job_id, Task.sequence, Task.status).where(Task.status.in_(HELD_TASKS))).all()
    groups: dict[tuple[str, TaskStatus], list[int]] = defaultdict(list)
    for job_id, sequence, status in held:
        groups[job_id, status].append(sequence)
    for (job_id, status), sequences in groups.items():
        transition_tasks(session, job_id, sequences, status, TaskStatus.READY, progress=None)
    changed(session, delete(StopRequest))
    values = {"leader": None, "leader_until_s": 0.0, "stream_position": "0-0", "store_id": store_id}
    changed(session, update(CoordinatorRow).values(values))
    advance_ids(session.connection(), JobEvent.__tablename__, JobEvent.id.key, by=EVENT_GAP)
    advance_ids(session.connection(), AuditRow.__tablename__, AuditRow.id.key, by=1)
    return len(held)
