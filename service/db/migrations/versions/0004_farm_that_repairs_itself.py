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
    op.add_column("tasks", sa.Column("digests", sa.JSON(), nullable=True))
    op.add_column("tasks", sa.Column("error_artifact", sa.String(200), nullable=True))
    op.add_column("tasks", sa.Column("repairs", sa.BigInteger(), nullable=False, server_default="0"))
    for name, kind in (
        ("paused_by", sa.String(16)),
        ("pause_code", sa.String(64)),
        ("pause_reason", sa.Text()),
        ("paused_s", sa.Double()),
    ):
        op.add_column("jobs", sa.Column(name, kind, nullable=True))
    op.add_column("worker_faults", sa.Column("code", sa.String(64), nullable=True))
    op.add_column("worker_faults", sa.Column("message", sa.Text(), nullable=True))
    op.add_column("coordinator", sa.Column("faults", sa.JSON(), nullable=True))
