"""Checks that the database file is whole and that its schema is the one of this version."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import Connection, text

from service.backup.write import revision_of
from service.db.migrations import revisions
from service.doctor.finding import Check, Finding, Level


def check_integrity(connection: Connection) -> Iterator[Finding]:
    """Yield what SQLite finds wrong with its file; PostgreSQL keeps its own files and foreign keys whole."""
    if connection.dialect.name != "sqlite":
        return
    answers = [str(answer) for (answer,) in connection.execute(text("PRAGMA integrity_check(10)"))]
    if answers != ["ok"]:
        yield Finding(Check.INTEGRITY, Level.ERROR, f"the database file is damaged: {'; '.join(answers)}")
        return
    broken: dict[tuple[str, str], int] = {}
    for table, _, parent, _ in connection.execute(text("PRAGMA foreign_key_check")):
        broken[table, parent] = broken.get((table, parent), 0) + 1
    for (table, parent), count in broken.items():
        message = f"{count} rows of {table} refer to rows of {parent} that do not exist"
        yield Finding(Check.FOREIGN_KEYS, Level.ERROR, message)


def check_schema(connection: Connection) -> Iterator[Finding]:
    """Yield a finding if the schema is not that of this version; then nothing else can be examined."""
    head, found = revisions()[0], revision_of(connection)
    if found is None:
        yield Finding(Check.SCHEMA, Level.ERROR, "expected the database of a farm, got one without a schema revision")
    elif found not in revisions():
        message = f"expected a schema revision up to {head}, got {found}: a newer version wrote it"
        yield Finding(Check.SCHEMA, Level.ERROR, message)
    elif found != head:
        message = (
            f"the schema revision is {found}; the next start upgrades it to {head}, and the rows can be examined then"
        )
        yield Finding(Check.SCHEMA, Level.WARNING, message)
