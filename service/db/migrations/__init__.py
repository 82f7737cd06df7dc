"""How a database of any age becomes today's: Alembic, packaged, run at every start."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from sqlalchemy import insert, select

from service.db.engine import Database
from service.db.tables import ClerkRow

FOLDER = Path(__file__).parent


def migrate(database: Database) -> None:
    """Bring a database to today's form, whole or not at all, and lay down the clerk's row."""
    with database.connecting() as connection:
        config = Config()
        config.set_main_option("script_location", str(FOLDER).replace("%", "%%"))
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
        if connection.execute(select(ClerkRow.id)).first() is None:
            connection.execute(insert(ClerkRow).values(id=1))
