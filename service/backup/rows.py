"""The tables of a database as compressed JSON lines, in a form that SQLite and PostgreSQL share.

The tables are those that the database has, and not those of this version, so a database of an earlier release can be
backed up before it is upgraded.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

from sqlalchemy import JSON, Column, Connection, LargeBinary, MetaData, Table, event, insert, select, text

from service.backup.files import read_lines, write_lines
from service.backup.manifest import BackupBroken, Lines

CHUNK = 1000
"""The number of rows that are read or written together."""
_NOT_DATA = frozenset({"alembic_version"})


def tables_of(connection: Connection) -> list[Table]:
    """Return the tables that the database has, each after those that it refers to."""
    metadata = MetaData()
    event.listen(metadata, "column_reflect", _with_null)
    metadata.reflect(bind=connection)
    return [table for table in metadata.sorted_tables if table.name not in _NOT_DATA]


def dump_tables(connection: Connection, folder: Path) -> dict[str, Lines]:
    """Write every table to a folder; return what was written, by table."""
    return {
        table.name: write_lines(_path(folder, table.name), _dumped(connection, table))
        for table in tables_of(connection)
    }


def load_tables(connection: Connection, folder: Path, written: Mapping[str, Lines]) -> None:
    """Insert the rows of a backup into empty tables.

    Raises
    ------
    BackupBroken
        If the tables or columns of the backup are not those of its schema revision.
    """
    tables = tables_of(connection)
    if {table.name for table in tables} != set(written):
        raise BackupBroken(f"expected the tables {sorted(table.name for table in tables)}, got {sorted(written)}")
    for table in tables:
        connection.execute(table.delete())  # A migration inserts the row of the coordinator.
    for table in tables:
        rows = _loaded(table, read_lines(_path(folder, table.name), written[table.name]))
        while chunk := list(islice(rows, CHUNK)):
            connection.execute(insert(table), chunk)


def advance_ids(connection: Connection, table: str, column: str, *, by: int) -> None:
    """Let the next automatic id of a table be higher than all of its rows by at least `by`."""
    highest = int(connection.execute(text(f"SELECT coalesce(max({column}), 0) FROM {table}")).scalar_one())  # noqa: S608 - names of this code
    if connection.dialect.name == "sqlite":
        connection.execute(text("DELETE FROM sqlite_sequence WHERE name = :name"), {"name": table})
        values = {"name": table, "seq": highest + by}
        connection.execute(text("INSERT INTO sqlite_sequence (name, seq) VALUES (:name, :seq)"), values)
    else:
        statement = text("SELECT setval(pg_get_serial_sequence(:name, :column), :seq)")
        connection.execute(statement, {"name": table, "column": column, "seq": highest + by})


def path_of_table(backup_database: Path, name: str) -> Path:
    """Return the file of a table; a name that is no name of a table is refused."""
    return _path(backup_database, name)


def _path(folder: Path, table: str) -> Path:
    if not table.replace("_", "").isalnum() or not table.isascii():
        raise BackupBroken(f"expected the name of a table, got {table!r}")
    return folder / f"{table}.jsonl.gz"


def _with_null(_inspector: Any, _table: Any, column: Any) -> None:
    # A reflected column would store None as the JSON value null instead of NULL.
    if isinstance(column["type"], JSON):
        column["type"] = JSON(none_as_null=True)


def _dumped(connection: Connection, table: Table) -> Iterator[Any]:
    yield [column.name for column in table.columns]
    binary = [i for i, column in enumerate(table.columns) if isinstance(column.type, LargeBinary)]
    rows = connection.execution_options(yield_per=CHUNK).execute(select(table).order_by(*table.primary_key))
    for row in rows:
        values = list(row)
        for i in binary:
            values[i] = None if values[i] is None else base64.b64encode(values[i]).decode()
        yield values


def _loaded(table: Table, lines: Iterable[Any]) -> Iterator[dict[str, Any]]:
    lines = iter(lines)
    names = next(lines, None)
    if not isinstance(names, list) or set(names) != set(table.columns.keys()):
        raise BackupBroken(f"expected the columns {sorted(table.columns.keys())} of {table.name}, got {names}")
    binary = [name for name in names if _is_binary(table.columns[name])]
    for values in lines:
        if not isinstance(values, list) or len(values) != len(names):
            raise BackupBroken(f"expected a row of {len(names)} values in {table.name}, got another")
        row = dict(zip(names, values, strict=True))
        for name in binary:
            row[name] = None if row[name] is None else base64.b64decode(row[name])
        yield row


def _is_binary(column: Column[Any]) -> bool:
    return isinstance(column.type, LargeBinary)
