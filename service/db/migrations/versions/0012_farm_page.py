"""Add the workers that are excluded, and the index by which the work of the last hours is found."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

HAS_ENDED = sa.text("ended_s IS NOT NULL")


def upgrade() -> None:
    """Apply the migration."""
    op.create_table(
        "exclusions",
        sa.Column("worker", sa.String(100), primary_key=True),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("since_s", sa.Double(), nullable=False),
    )
    op.create_index("ix_tasks_ended", "tasks", ["ended_s"], sqlite_where=HAS_ENDED, postgresql_where=HAS_ENDED)
