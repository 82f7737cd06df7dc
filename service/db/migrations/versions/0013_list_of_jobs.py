"""Add the index of SQLite from which lists of jobs are searched, sorted and counted."""

from __future__ import annotations

from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None

LISTED = ["title", "scene", "owner", "owner_id", "shared", "status", "background_job", "priority", "frames_total", "id"]


def upgrade() -> None:
    """Apply the migration."""
    if op.get_bind().dialect.name == "sqlite":
        op.create_index("ix_jobs_listed", "jobs", LISTED)
