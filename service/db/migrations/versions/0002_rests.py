"""Count how often a task was deferred because the farm, not the task, was at fault."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Apply the migration."""
    op.add_column("tasks", sa.Column("rests", sa.BigInteger(), server_default="0", nullable=False))
