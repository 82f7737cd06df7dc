"""Add the columns with which a browser session replaces its token, and the one by which a job is shared."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Apply the migration."""
    op.add_column("credentials", sa.Column("next_sha256", sa.String(64), nullable=True))
    op.add_column("credentials", sa.Column("next_s", sa.Double(), nullable=True))
    op.add_column("credentials", sa.Column("old_sha256", sa.String(64), nullable=True))
    op.add_column("credentials", sa.Column("renewed_s", sa.Double(), nullable=True))
    op.add_column("jobs", sa.Column("shared", sa.Boolean(), nullable=False, server_default=sa.false()))
