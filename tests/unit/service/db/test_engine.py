"""Services and commands that start together on one new SQLite file all begin to work."""

from __future__ import annotations

import multiprocessing
import sqlite3
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from multiprocessing.queues import SimpleQueue
from multiprocessing.synchronize import Barrier
from pathlib import Path

import pytest
from sqlalchemy import text
from sqlalchemy.exc import OperationalError

from lippmann.errors import BadInput, FarmFailed
from service.db import coordinator as coordinator_rows
from service.db import engine
from service.db.engine import Database, opened
from service.db.migrations import migrate
from service.db.tables import CoordinatorRow
from tests.postgresql import new_database
from tests.waiting import ENOUGH_S

PROCESSES, FILES = 4, 6


@pytest.mark.promise("People", "Only its user may read the database file.")
def test_only_its_user_may_read_a_database_file_old_ones_included(tmp_path: Path) -> None:
    path = tmp_path / "farm.db"
    for _ in range(2):
        database = Database(f"sqlite:///{path}")
        migrate(database)
        with database.writing() as session:
            session.execute(text("UPDATE coordinator SET stream_position = '1-0'"))
        assert {file.name: file.stat().st_mode & 0o777 for file in tmp_path.glob("farm.db*")} == {
            "farm.db": 0o600, "farm.db-wal": 0o600, "farm.db-shm": 0o600,
        }  # fmt: skip
        database.dispose()
        path.chmod(0o644)  # as an older version left it


def test_the_first_connection_waits_for_another_process_that_writes_to_the_new_file(tmp_path: Path) -> None:
    with ThreadPoolExecutor(1) as pool, _writing(tmp_path / "new.db") as other:
        opened = pool.submit(_journal_mode, tmp_path / "new.db")
        with pytest.raises(TimeoutError):
            opened.result(timeout=1)
        other.execute("COMMIT")
        assert opened.result(ENOUGH_S) == "wal"


def test_the_first_connection_does_not_wait_for_ever(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "BUSY_TIMEOUT_S", 0.2)
    with _writing(tmp_path / "new.db"), pytest.raises(OperationalError, match="locked"):
        _journal_mode(tmp_path / "new.db")


def test_another_error_than_a_lock_is_an_error_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "BUSY_TIMEOUT_S", ENOUGH_S)
    with _writing(tmp_path / "new.db") as other:
        other.execute("CREATE TABLE a (b)")
        other.execute("COMMIT")
    started_s = time.monotonic()
    with pytest.raises(OperationalError, match="readonly"):
        _journal_mode(f"file:{tmp_path}/new.db?mode=ro&uri=true")
    assert time.monotonic() - started_s < ENOUGH_S


def test_a_process_that_was_stopped_in_a_write_transaction_does_not_keep_the_writer(
    postgresql: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "LONGEST_IDLE_S", 0.2)
    with new_database(postgresql) as url, _disposed(Database(url)) as database:
        migrate(database)
        with pytest.raises(OperationalError):
            _stop_while_another_writes(database)
        with database.reading() as session:
            assert coordinator_rows.current(session).idle_s == 2.0


def test_processes_that_start_together_on_new_files_all_find_the_tables(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    together, errors = context.Barrier(PROCESSES, timeout=ENOUGH_S), context.SimpleQueue()
    arguments = (tmp_path, together, errors)
    processes = [context.Process(target=_migrate_all, args=arguments, daemon=True) for _ in range(PROCESSES)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(ENOUGH_S)
    assert [errors.get() for process in processes if process.exitcode == 0] == [""] * PROCESSES
    for number in range(FILES):
        database = Database(f"sqlite:///{tmp_path}/{number}.db")
        with database.reading() as session:
            assert session.query(CoordinatorRow).count() == 1
        database.dispose()


def _migrate_all(folder: Path, together: Barrier, errors: SimpleQueue[str]) -> None:
    """Migrate new databases, each at the moment at which the other processes do; runs in a process of its own."""
    error = ""
    for number in range(FILES):
        together.wait()
        database = Database(f"sqlite:///{folder}/{number}.db")
        try:
            migrate(database)
        except Exception as raised:
            error += f"{raised}; "
        database.dispose()
    errors.put(error)


def _journal_mode(file: Path | str) -> str:
    database = Database(f"sqlite:///{file}")
    try:
        with database.reading() as session:
            return str(session.execute(text("PRAGMA journal_mode")).scalar_one())
    finally:
        database.dispose()


@contextmanager
def _writing(file: Path) -> Iterator[sqlite3.Connection]:
    """Open a connection in a write transaction on a new file that has no write-ahead log yet."""
    with closing(sqlite3.connect(file, isolation_level=None, check_same_thread=False)) as connection:
        connection.execute("BEGIN IMMEDIATE")
        yield connection


@contextmanager
def _disposed(database: Database) -> Iterator[Database]:
    yield database
    database.dispose()


def _stop_while_another_writes(database: Database) -> None:
    with database.writing() as stopped:
        coordinator_rows.add_idle(stopped, 1.0)
        with database.writing() as other:
            coordinator_rows.add_idle(other, 2.0)
        coordinator_rows.add_idle(stopped, 1.0)


@pytest.mark.parametrize(
    "url", ["foo", "mysql://me:hunter2@host/farm", "postgresql+none://me:hunter2@host/farm", "postgresql://h:hunter2/f"]
)
def test_a_url_of_no_database_is_refused_without_its_password(url: str) -> None:
    with pytest.raises(BadInput, match=r"^LIPPMANN_DATABASE_URL: expected postgresql\+psycopg:.*, got another value$"):
        Database(url)


def test_without_psycopg_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "psycopg", None)
    with pytest.raises(BadInput, match="expected the extra `postgresql` of the package to be installed"):
        Database("postgresql+psycopg://me@host/farm")


def test_a_file_that_is_no_database_is_refused_as_what_it_is(tmp_path: Path) -> None:
    (tmp_path / "farm.db").write_bytes(b"no database" * 1000)
    with (
        pytest.raises(FarmFailed, match="expected a database, got a file that is damaged or none: file is not a data"),
        opened(f"sqlite:///{tmp_path}/farm.db") as database,
        database.reading() as session,
    ):
        session.execute(text("SELECT 1"))
