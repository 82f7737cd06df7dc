"""Rename tables and columns to the field's standard terms, and store the frame of a failure in a column of its own."""

from __future__ import annotations

import json
import re
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

TABLES = {"clerk": "coordinator", "stopped_attempts": "stop_requests"}
COLUMNS = {
    "jobs": {"chore": "background_job"},
    "tasks": {"rests": "deferrals", "beat_s": "heartbeat_s"},
    "worker_faults": {"until_s": "avoided_until_s"},
    "coordinator": {"until_s": "leader_until_s", "position": "stream_position"},
    "stop_requests": {"at_s": "requested_s"},
}
ACTIONS = {
    "queued": ["cancel", "prioritise"],
    "probing": ["pause", "cancel", "prioritise"],
    "running": ["pause", "cancel", "prioritise"],
    "paused": ["resume", "cancel", "prioritise"],
    "done": ["remove"],
    "failed": ["retry", "prioritise", "remove"],
    "cancelled": ["retry", "prioritise", "remove"],
}
"""The actions of each status at the time of this migration: a `job` event now lists them."""
UNREADABLE = ("artifact-missing", "artifact-broken")
FRAME = re.compile(r"(?<!\d)(\d{4,9})\.exr")
"""Failures that were stored before this migration name the frame only in their message, as `0003.exr`."""


def upgrade() -> None:
    """Apply the migration."""
    for old, new in TABLES.items():
        op.rename_table(old, new)
    for table, columns in COLUMNS.items():
        for old, new in columns.items():
            # SQLite and PostgreSQL share this statement; Alembic would copy whole tables on SQLite.
            op.execute(f'ALTER TABLE {table} RENAME COLUMN "{old}" TO "{new}"')
    op.drop_index("ix_jobs_chore", table_name="jobs")
    op.create_index("ix_jobs_background_job", "jobs", ["background_job"])
    op.add_column("tasks", sa.Column("error_frame", sa.BigInteger(), nullable=True))
    _fill_error_frames(op.get_bind())
    _add_actions(op.get_bind())


def _fill_error_frames(connection: sa.Connection) -> None:
    tasks = sa.table("tasks", *map(sa.column, ("job_id", "sequence", "error_code", "error_message", "error_frame")))
    query = sa.select(tasks.c.job_id, tasks.c.sequence, tasks.c.error_message)
    for job_id, sequence, message in connection.execute(query.where(tasks.c.error_code.in_(UNREADABLE))).all():
        match = FRAME.search(message or "")
        if match is not None:
            which = (tasks.c.job_id == job_id, tasks.c.sequence == sequence)
            connection.execute(sa.update(tasks).where(*which).values(error_frame=int(match[1])))


def _add_actions(connection: sa.Connection) -> None:
    events = sa.table("job_events", sa.column("id"), sa.column("topic"), sa.column("data", sa.JSON()))
    query = sa.select(events.c.id, events.c.data).where(events.c.topic == "job")
    for identifier, stored in connection.execute(query).all():
        data: dict[str, Any] = json.loads(stored) if isinstance(stored, str) else stored
        if data.get("status") in ACTIONS:
            added = data | {"actions": ACTIONS[data["status"]]}
            connection.execute(sa.update(events).where(events.c.id == identifier).values(data=added))
