"""Add the scene bundle of a job, so that bundles that nobody needs can be deleted, and the webhook of the farm.

The jobs of earlier releases get theirs from their job files, which only the store has; see
`service.coordinator.bundle_collector`.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Apply the migration."""
    op.add_column("jobs", sa.Column("bundle", sa.String(64), nullable=True))
    op.create_index("ix_jobs_bundle", "jobs", ["bundle"])
    op.add_column("jobs", sa.Column("farm_webhook_url", sa.Text(), nullable=True))
