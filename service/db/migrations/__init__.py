"""Alembic migrations, which upgrade a database of any earlier release at every start."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, insert, select

from service.db.engine import Database
from service.db.statistics import fix_statistics
from service.db.tables import CoordinatorRow

FOLDER = Path(__file__).parent


def migrate(database: Database) -> None:
    """Upgrade a database completely or not at all, and insert the coordinator's row if it is missing."""
    with database.connecting() as connection:
        command.upgrade(alembic_config(connection), "head")
        if connection.execute(select(CoordinatorRow.id)).first() is None:
            connection.execute(insert(CoordinatorRow).values(id=1))
        if database.is_sqlite:
            fix_statistics(connection)


def revisions() -> list[str]:
    """Return the schema revisions that this version knows, newest first."""
    scripts = ScriptDirectory.from_config(_config())
    return [script.revision for script in scripts.walk_revisions()]


def alembic_config(connection: Connection) -> Config:
    """Return the configuration of Alembic for a write connection."""
    config = _config()
    config.attributes["connection"] = connection
    return config


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", str(FOLDER).replace("%", "%%"))
    return config
