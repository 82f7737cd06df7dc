"""Add what tells the farm's own store from an empty folder or another store in its place."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Apply the migration."""
    op.add_column("coordinator", sa.Column("store_id", sa.String(64), nullable=True))
