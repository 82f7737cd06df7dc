"""Transactions with a single writer, on SQLite and PostgreSQL.

What a write transaction reads remains true until it commits.
"""

from __future__ import annotations

import os
import sqlite3
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from copy import copy
from pathlib import Path
from typing import Any, TypeVar, cast

from sqlalchemy import Connection, CursorResult, create_engine, event, text
from sqlalchemy.engine import URL, Engine, ExceptionContext, make_url
from sqlalchemy.exc import ArgumentError, DatabaseError, DBAPIError, OperationalError
from sqlalchemy.orm import Session
from sqlalchemy.sql.dml import UpdateBase

from lippmann.errors import BadInput, FarmFailed
from service.db.reserve import Reserve, is_full
from service.instruments import timed_transaction

Answer = TypeVar("Answer")

BUSY_TIMEOUT_S = 10.0
BUSY_PAUSE_S = 0.01
"""The pause before a new SQLite file that another process writes to is tried again."""
POOL: dict[str, Any] = {"pool_size": 10, "max_overflow": 50, "pool_timeout": BUSY_TIMEOUT_S}
"""One connection for each of the 40 threads that answer requests, and for the threads of the coordinator."""
CONNECT_S = 5
"""The longest time in which a connection to PostgreSQL is made."""
SILENCE_S = 15
"""The time after which a connection to PostgreSQL whose other end acknowledges nothing has ended, for both ends."""
WRITER_LOCK = 1908
"""PostgreSQL's advisory lock of the single writer: events get their ids in the order in which they become visible."""
LONGEST_IDLE_S = 15.0
"""The time without a statement after which PostgreSQL ends a write transaction. A process that was stopped in the
middle of one, or cut from the database, would otherwise keep every other process from writing. A machine that does much
else may pause for seconds."""
_IDLE = "25P03"
"""PostgreSQL's code of the error with which it does so."""
_LACKING = ("42P01", "42703", "42501", "no such table", "no such column", "has no column named")
"""PostgreSQL's codes of errors about a missing table, column or right, and what SQLite says."""


class Database:
    """A database with read transactions and write transactions.

    Parameters
    ----------
    reserve_bytes
        The size of the file that is given up when the disk of SQLite is full, bytes; see `service.db.reserve`.

    Raises
    ------
    BadInput
        If the URL is not one of a database that can be used.
    """

    def __init__(self, url: str, *, reserve_bytes: int = 0) -> None:
        try:
            self.url = make_url(url)
            self.is_sqlite = self.url.get_backend_name() == "sqlite"
            self._engine = _sqlite_engine(self.url) if self.is_sqlite else _postgresql_engine(self.url)
        except (ArgumentError, ImportError, ValueError) as error:  # No URL, no such driver, no number as the port.
            raise _refusal(error) from None
        self._write_engine = self._engine.execution_options(writes=True)
        self._check: Callable[[Session], None] | None = None
        file = self.url.database if self.is_sqlite else None
        self.reserve = Reserve(Path(f"{file}.reserve") if file else None, reserve_bytes)

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """Open a session that only reads."""
        with timed_transaction(writes=False), Session(self._engine, expire_on_commit=False) as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """Open a session that writes, commits at the end and rolls back on an error.

        When the disk is full, the reserve is given up, so that the next transaction finds room.
        """
        try:
            with (
                timed_transaction(writes=True),
                Session(self._write_engine, expire_on_commit=False, autoflush=False) as session,
                session.begin(),
            ):
                if self._check is not None:
                    self._check(session)
                yield session
        except DBAPIError as error:
            if is_full(error):
                self.reserve.give_up()
            raise

    def guarded(self, check: Callable[[Session], None]) -> Database:
        """Return this database with a check that begins every write transaction, and fails it by an error.

        What it has checked in the transaction of the single writer remains true until the transaction commits.
        """
        twin = copy(self)
        twin._check = check
        return twin

    def write_in_reserve(self, work: Callable[[Session], Answer]) -> Answer:
        """Do `work` in a write transaction, and once more if the reserve was given up for it: for actions on jobs."""
        was_given_up = self.reserve.is_given_up
        try:
            with self.writing() as session:
                return work(session)
        except DBAPIError as error:
            if not is_full(error) or was_given_up:
                raise
        with self.writing() as session:
            return work(session)

    @contextmanager
    def snapshot(self) -> Iterator[Connection]:
        """Open a connection whose queries all see the database as it is at the first of them; writers do not wait."""
        options = {} if self.is_sqlite else {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}
        with self._engine.connect().execution_options(**options) as connection, connection.begin():
            yield connection

    @contextmanager
    def connecting(self) -> Iterator[Connection]:
        """Open a write connection for migrations."""
        if self.is_sqlite and self.url.database:
            _make_private(Path(self.url.database))
        with self._write_engine.execution_options(may_idle=True).begin() as connection:
            yield connection

    def checkpoint(self) -> None:
        """Checkpoint SQLite's write-ahead log, so that it does not grow without bound."""
        if self.is_sqlite:
            # The pragma does nothing inside a transaction, so it runs on the driver's own connection.
            with self._engine.connect() as connection, closing(connection.connection.cursor()) as cursor:
                cursor.execute("PRAGMA wal_checkpoint(TRUNCATE)")

    def count_tasks(self) -> None:
        """Let PostgreSQL count the tasks for its plans, which it does by itself only after a minute.

        Until then, each statement about one task of a new job may read all of them. SQLite has statistics of its own,
        see `service.db.statistics`.
        """
        if self.is_sqlite:
            return
        # Another process may count at the same time, which is as good.
        with suppress(OperationalError), self._engine.begin() as connection:
            connection.execute(text("ANALYZE tasks"))

    def dispose(self) -> None:
        """Close every connection."""
        self._engine.dispose()


@contextmanager
def opened(url: str, *, must_exist: bool = True) -> Iterator[Database]:
    """Open a database for one command.

    Raises
    ------
    BadInput
        If the database is a file that does not exist, although it must.
    FarmFailed
        If the database does not answer, is damaged or none, or has not the tables of this version or no right to them.
    """
    database = Database(url)
    if must_exist and database.is_sqlite and not Path(database.url.database or "").is_file():
        raise BadInput(f"expected the database of a farm, got no {database.url.database}")
    try:
        yield database
    except DatabaseError as error:
        if _lacks_tables(error):
            raise FarmFailed(
                "expected a database with the tables of this version and the right to use them, which "
                f"`lippmann migrate` makes, got: {error.orig}"
            ) from error
        if isinstance(error, OperationalError):
            raise FarmFailed(f"the database does not answer: {error.orig}") from error
        if type(error) is DatabaseError:  # What SQLite says of a file.
            raise FarmFailed(f"expected a database, got a file that is damaged or none: {error.orig}") from error
        raise
    finally:
        database.dispose()


def _refusal(error: Exception) -> BadInput:
    """Return what is wrong with the URL of a database, which is not repeated, since it has a password in it."""
    expected, got = "postgresql+psycopg://USER:PASSWORD@HOST:PORT/NAME", "another value"
    if isinstance(error, ImportError) and error.name == "psycopg":
        expected, got = "the extra `postgresql` of the package to be installed", "no psycopg"
    return BadInput(f"LIPPMANN_DATABASE_URL: expected {expected}, got {got}")


def _lacks_tables(error: DBAPIError) -> bool:
    return getattr(error.orig, "sqlstate", None) in _LACKING or any(words in str(error.orig) for words in _LACKING)


def changed(session: Session, statement: UpdateBase, values: Mapping[str, Any] | None = None) -> int:
    """Run a guarded UPDATE or DELETE and return the number of rows that it changed."""
    options = {"synchronize_session": False}
    return cast(CursorResult[Any], session.execute(statement, values, execution_options=options)).rowcount


def _sqlite_engine(url: URL) -> Engine:
    engine = create_engine(url, connect_args={"timeout": BUSY_TIMEOUT_S, "check_same_thread": False}, **POOL)
    event.listen(engine, "connect", _prepare_sqlite)
    event.listen(engine, "begin", _begin_sqlite)
    return engine


def _prepare_sqlite(connection: Any, _record: Any) -> None:
    connection.isolation_level = None  # the driver begins no transaction; _begin_sqlite does
    _use_write_ahead_log(connection)
    for pragma in ("synchronous=NORMAL", "foreign_keys=ON"):
        connection.execute(f"PRAGMA {pragma}").fetchall()
    connection.execute(f"PRAGMA busy_timeout={int(BUSY_TIMEOUT_S * 1000)}").fetchall()


def _use_write_ahead_log(connection: Any) -> None:
    """Change a new file to the write-ahead log, which SQLite refuses at once while another process writes to the file.

    The busy timeout does not hold for this statement, so processes that start together on a new file try again.
    """
    end_s = time.monotonic() + BUSY_TIMEOUT_S
    while True:
        try:
            connection.execute("PRAGMA journal_mode=WAL").fetchall()
            return
        except sqlite3.OperationalError as error:
            is_busy = error.sqlite_errorcode & 0xFF == sqlite3.SQLITE_BUSY  # also its extended codes
            if not is_busy or time.monotonic() > end_s:
                raise
        time.sleep(BUSY_PAUSE_S)


def _begin_sqlite(connection: Connection) -> None:
    # A transaction that reads and then writes fails at once if another wrote in between, so writers lock first.
    writes = connection.get_execution_options().get("writes")
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _postgresql_engine(url: URL) -> Engine:
    engine = create_engine(url, pool_pre_ping=True, **POOL, connect_args=_connection_options())
    # Rows are inserted many at a time; otherwise each row is a statement of its own.
    engine.dialect.use_insertmanyvalues_wo_returning = True
    event.listen(engine, "begin", _begin_postgresql)
    event.listen(engine, "handle_error", _as_unavailable)
    return engine


def _connection_options() -> dict[str, Any]:
    """Return the limits of a connection, with those that the server keeps.

    A network that loses packets tells nobody. By default, a thread waits for an answer for hours; and the server keeps
    the transaction of a client that is gone for as long, and with it the lock of the single writer.
    """
    probe_s = max(1, SILENCE_S // 3)
    ours = {
        "connect_timeout": CONNECT_S, "tcp_user_timeout": SILENCE_S * 1000,
        "keepalives_idle": probe_s, "keepalives_interval": probe_s, "keepalives_count": 2,
    }  # fmt: skip
    of_server = {
        "lock_timeout": 10_000, "tcp_user_timeout": SILENCE_S * 1000,
        "tcp_keepalives_idle": probe_s, "tcp_keepalives_interval": probe_s, "tcp_keepalives_count": 2,
    }  # fmt: skip
    return {**ours, "options": " ".join(f"-c {name}={value}" for name, value in of_server.items())}


_LOCK = text("SELECT set_config('idle_in_transaction_session_timeout', :idle, true), pg_advisory_xact_lock(:lock)")


def _begin_postgresql(connection: Connection) -> None:
    options = connection.get_execution_options()
    if not options.get("writes"):
        return
    idle_s = 0.0 if options.get("may_idle") else LONGEST_IDLE_S
    connection.execute(_LOCK, {"lock": WRITER_LOCK, "idle": f"{idle_s * 1000:.0f}"})


def _as_unavailable(context: ExceptionContext) -> OperationalError | None:
    """Return the error of a transaction that was ended because it was idle as what it is: a lost connection."""
    error = context.original_exception
    if getattr(error, "sqlstate", None) != _IDLE:
        return None
    context.is_disconnect = True
    return OperationalError(context.statement, context.parameters, error, connection_invalidated=True)


def _make_private(path: Path) -> None:
    """Create a database file that only its user may read; SQLite gives its other files the same mode."""
    path.parent.mkdir(parents=True, exist_ok=True)
    # What cannot be created or changed here is left to SQLite, which says what is wrong.
    with suppress(OSError):
        os.close(os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600))
    for file in (path, *(path.with_name(path.name + suffix) for suffix in ("-wal", "-shm"))):
        with suppress(OSError):
            file.chmod(0o600)
