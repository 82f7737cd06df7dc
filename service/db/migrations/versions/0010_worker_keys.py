"""Add the columns of worker keys, which may have users of their own at the broker."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Apply the migration."""
    op.add_column("credentials", sa.Column("has_broker_user", sa.Boolean(), nullable=False, server_default=sa.false()))
    op.add_column("credentials", sa.Column("revoked_s", sa.Double(), nullable=True))
