"""Run the migrations on the connection that `migrate` provides."""

from __future__ import annotations

from alembic import context

from service.db.tables import Base


def run() -> None:
    """Upgrade the database of the connection."""
    context.configure(
        connection=context.config.attributes["connection"], target_metadata=Base.metadata, render_as_batch=True
    )
    context.run_migrations()


if __name__ == "env_py":  # the name under which Alembic executes this file; an import runs nothing
    run()
