"""A PostgreSQL on another host, from which packets come no longer: nobody waits for it, and it waits for nobody."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
from sqlalchemy import text
from sqlalchemy.exc import OperationalError

from service.db import engine
from service.db.engine import Database
from tests.network_host import NetworkHost, network_host, why_no_network_host
from tests.postgresql import running_postgresql

pytestmark = pytest.mark.skipif(bool(reason := why_no_network_host()), reason=str(reason))

SOON_S = 60.0
"""Much longer than the patched times, and much shorter than those of the system."""

SETTLED_S = 0.2
"""The time after which no packet of a connection without work travels any more."""


@pytest.fixture(scope="module")
def host() -> Iterator[NetworkHost]:
    with network_host() as lent:
        yield lent


@pytest.fixture(scope="module")
def server(host: NetworkHost) -> Iterator[str]:
    with running_postgresql(host) as url:
        yield f"{url}postgres"


@pytest.fixture
def database(server: str, host: NetworkHost, monkeypatch: pytest.MonkeyPatch) -> Iterator[Database]:
    monkeypatch.setattr(engine, "SILENCE_S", 2)
    monkeypatch.setattr(engine, "LONGEST_IDLE_S", 600.0)  # It ends a transaction too, but only one that is idle.
    made = Database(server)
    yield made
    host.pass_on()
    made.dispose()


def test_a_query_ends_whose_answer_never_comes(database: Database, host: NetworkHost) -> None:
    with ThreadPoolExecutor(1) as pool, database.reading() as session:
        session.execute(text("SELECT 1"))
        asked = pool.submit(session.execute, text("SELECT pg_sleep(0.5)"))
        host.lose("requests")  # what the database sends
        try:
            with pytest.raises(OperationalError):
                asked.result(SOON_S)
        finally:
            host.pass_on()
        session.invalidate()


def test_the_lock_of_a_writer_that_is_gone_is_free_soon(database: Database, host: NetworkHost, server: str) -> None:
    def vanish() -> None:
        time.sleep(
            SETTLED_S
        )  # Otherwise the server sends again what is not acknowledged, and learns that nobody is there.
        host.lose()

    with pytest.raises(OperationalError):
        _write(database, vanish)
    time.sleep(SETTLED_S)  # The last packet of the old connection is lost too, as is that of a host without power.
    host.pass_on()
    other = Database(server)
    _write(other, lambda: None)  # It waits for the lock for 10 s.
    other.dispose()


def _write(database: Database, meanwhile: Callable[[], None]) -> None:
    with database.writing() as session:
        session.execute(text("SELECT 1"))
        meanwhile()
