"""Add owners, the last use and the limits of keys, the audit log, and the id of the artifact store."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Apply the migration."""
    _add_owners()
    op.add_column("coordinator", sa.Column("store_id", sa.String(64), nullable=True))
    op.add_column("credentials", sa.Column("used_s", sa.Double(), nullable=True))
    op.add_column("credentials", sa.Column("limits", sa.JSON(), nullable=True))
    op.create_table(
        "audit",
        sa.Column(
            "id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), primary_key=True, autoincrement=True,
            nullable=False,
        ),
        sa.Column("at_s", sa.Double(), nullable=False),
        sa.Column("key_id", sa.String(32), nullable=False),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("role", sa.String(16), nullable=False),
        sa.Column("action", sa.String(32), nullable=False),
        sa.Column("subject", sa.String(200), nullable=False),
        sa.Column("detail", sa.Text(), nullable=False),
        sa.Column("address", sa.String(100), nullable=False),
        sa.Column("request_id", sa.String(64), nullable=False),
        sqlite_autoincrement=True,
    )  # fmt: skip
    op.create_index("ix_audit_at", "audit", ["at_s"])


def _add_owners() -> None:
    # Jobs and scenes of earlier releases name no key, so they belong to the admin.
    for table, name in (
        ("jobs", "owner_id"),
        ("scenes", "owner"),
        ("scenes", "owner_id"),
        ("credentials", "owner_id"),
    ):
        op.add_column(table, sa.Column(name, sa.String(100), nullable=False, server_default="admin"))
    op.execute("UPDATE credentials SET owner_id = coalesce(parent, id) WHERE role <> 'admin'")
