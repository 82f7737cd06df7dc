"""Add the limits of slots and of stored bytes, and the number of refused messages.

The artifacts whose digests are known are counted. The scene bundles of earlier releases are counted without their
bytes, which only the store knows.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


_SQLITE = (
    "UPDATE tasks SET stored_bytes = "
    "(SELECT coalesce(sum(json_extract(value, '$[0]')), 0) FROM json_each(tasks.digests)) WHERE digests IS NOT NULL"
)
_POSTGRESQL = (
    "UPDATE tasks SET stored_bytes = "
    "(SELECT coalesce(sum(CAST(value ->> 0 AS BIGINT)), 0) FROM json_each(tasks.digests)) WHERE digests IS NOT NULL"
)


def upgrade() -> None:
    """Apply the migration."""
    op.add_column("jobs", sa.Column("max_slots", sa.BigInteger(), nullable=True))
    op.add_column("jobs", sa.Column("max_artifacts_mb", sa.BigInteger(), nullable=True))
    op.add_column("jobs", sa.Column("artifact_bytes", sa.BigInteger(), nullable=False, server_default="0"))
    op.add_column("tasks", sa.Column("stored_bytes", sa.BigInteger(), nullable=False, server_default="0"))
    op.add_column("coordinator", sa.Column("dropped", sa.JSON(), nullable=True))
    op.create_table(
        "owner_usage",
        sa.Column("owner_id", sa.String(100), primary_key=True, nullable=False),
        sa.Column("artifact_bytes", sa.BigInteger(), nullable=False),
    )
    op.create_table(
        "stored_bundles",
        sa.Column("owner_id", sa.String(100), primary_key=True, nullable=False),
        sa.Column("digest", sa.String(64), primary_key=True, nullable=False),
        sa.Column("bytes", sa.BigInteger(), nullable=False),
    )
    _count()


def _count() -> None:
    is_sqlite = op.get_bind().dialect.name == "sqlite"
    op.execute(_SQLITE if is_sqlite else _POSTGRESQL)
    op.execute(
        "UPDATE jobs SET artifact_bytes = "
        "(SELECT coalesce(sum(stored_bytes), 0) FROM tasks WHERE tasks.job_id = jobs.id)"
    )
    op.execute(
        "INSERT INTO owner_usage (owner_id, artifact_bytes) "
        "SELECT owner_id, sum(artifact_bytes) FROM jobs GROUP BY owner_id"
    )
    op.execute(
        "INSERT INTO stored_bundles (owner_id, digest, bytes) "
        "SELECT DISTINCT owner_id, digest, 0 FROM scenes WHERE NOT builtin"
    )
