"""Add what the coordinator needs to notice losses and damage by itself, and to work in sets."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Apply the migration."""
    op.add_column("tasks", sa.Column("instance", sa.String(32), nullable=True))
    op.add_column("tasks", sa.Column("losses", sa.BigInteger(), nullable=False, server_default="0"))
    op.add_column("tasks", sa.Column("digests", sa.JSON(), nullable=True))
    op.add_column("tasks", sa.Column("error_artifact", sa.String(200), nullable=True))
    op.add_column("tasks", sa.Column("repairs", sa.BigInteger(), nullable=False, server_default="0"))
    op.add_column("tasks", sa.Column("cached", sa.Boolean(), nullable=False, server_default=sa.false()))
    op.add_column("jobs", sa.Column("cache_hits", sa.BigInteger(), nullable=False, server_default="0"))
    op.add_column("jobs", sa.Column("cached_px", sa.BigInteger(), nullable=False, server_default="0"))
    for name, kind in (
        ("paused_by", sa.String(16)),
        ("pause_code", sa.String(64)),
        ("pause_reason", sa.Text()),
        ("paused_s", sa.Double()),
    ):
        op.add_column("jobs", sa.Column(name, kind, nullable=True))
    op.add_column("jobs", sa.Column("skipped", sa.BigInteger(), nullable=False, server_default="0"))
    op.add_column("worker_faults", sa.Column("code", sa.String(64), nullable=True))
    op.add_column("worker_faults", sa.Column("message", sa.Text(), nullable=True))
    op.add_column("coordinator", sa.Column("faults", sa.JSON(), nullable=True))
    _make_indexes()


def _make_indexes() -> None:
    for table, name in (
        ("jobs", "ix_jobs_status"),
        ("jobs", "ix_jobs_background_job"),
        ("tasks", "ix_tasks_job_stage"),
        ("tasks", "ix_tasks_job_needs"),
    ):
        op.drop_index(name, table_name=table)
    op.create_index("ix_jobs_status", "jobs", ["status", "id"])
    op.create_index("ix_tasks_job_stage", "tasks", ["job_id", "status", "stage"])
    for table, name, columns, where in (
        ("jobs", "ix_jobs_background_job", ["background_job"], "background_job IS NOT NULL"),
        ("jobs", "ix_jobs_busy", ["status", "id"], "dispatched + running > 0"),
        ("tasks", "ix_tasks_job_needs", ["job_id", "needs"], "status = 'waiting'"),
    ):
        op.create_index(name, table, columns, sqlite_where=sa.text(where), postgresql_where=sa.text(where))
