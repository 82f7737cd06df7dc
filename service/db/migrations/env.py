"""Runs migrations on the connection that `migrate` lends."""

from __future__ import annotations

from alembic import context

from service.db.tables import Base


def run() -> None:
    """Bring the lent connection's database up to date."""
    context.configure(
        connection=context.config.attributes["connection"], target_metadata=Base.metadata, render_as_batch=True
    )
    context.run_migrations()


if __name__ == "env_py":  # so Alembic calls this file when it runs it; whoever only imports it runs nothing
    run()
