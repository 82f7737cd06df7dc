"""Add what a job asks of its workers, its own limit of slots, and the workers that are drained."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

HAS_REQUIREMENT = sa.text("requirement <> ''")


def upgrade() -> None:
    """Apply the migration."""
    op.add_column("jobs", sa.Column("own_slots", sa.BigInteger(), nullable=True))
    op.add_column("jobs", sa.Column("requirement", sa.String(1000), nullable=False, server_default=""))
    op.create_index(
        "ix_jobs_requirement", "jobs", ["status", "requirement"],
        sqlite_where=HAS_REQUIREMENT, postgresql_where=HAS_REQUIREMENT,
    )  # fmt: skip
    op.create_table(
        "drains",
        sa.Column("instance", sa.String(64), primary_key=True),
        sa.Column("worker", sa.String(100), nullable=False),
        sa.Column("ends", sa.Boolean(), nullable=False),
        sa.Column("since_s", sa.Double(), nullable=False),
    )
