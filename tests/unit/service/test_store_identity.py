"""Which store a farm takes as its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from lippmann.errors import StoreUnavailable
from service.db.engine import Database
from service.db.migrations import migrate
from service.store_identity import adopt_store, identify_store, known_identity
from tests.builders_service import Farm
from worker.store.local import LocalStore


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    database = Database(f"sqlite:///{tmp_path}/new.db")
    migrate(database)
    yield database
    database.dispose()


@pytest.fixture
def used(tmp_path: Path) -> Iterator[Database]:
    """Return a database of a farm that has used a store, without its id, as the last release left it."""
    farm = Farm(f"sqlite:///{tmp_path}/used.db")
    assert known_identity(farm.database) is None
    yield farm.database
    farm.database.dispose()


def test_a_new_farm_gives_its_store_an_id(database: Database, tmp_path: Path) -> None:
    store = LocalStore(tmp_path / "store")
    identify_store(database, store)
    assert known_identity(database) == store.identity() is not None
    identify_store(database, store)
    store.put_bytes("a/b", b"")


def test_a_farm_of_the_last_release_goes_on_with_its_store(used: Database, tmp_path: Path) -> None:
    store = LocalStore(tmp_path / "store")
    store.put_bytes("scenes/ball.zip", b"")
    identify_store(used, store)
    assert known_identity(used) == store.identity() is not None


def test_a_store_that_has_an_id_keeps_it(database: Database, tmp_path: Path) -> None:
    identity = LocalStore(tmp_path / "store").make_identity()
    identify_store(database, LocalStore(tmp_path / "store"))
    assert known_identity(database) == identity


def test_a_farm_that_has_used_a_store_takes_no_empty_folder(used: Database, tmp_path: Path) -> None:
    store = LocalStore(tmp_path / "store")
    for _ in range(2):
        with pytest.raises(StoreUnavailable, match="it is empty, and this farm has used one"):
            identify_store(used, store)
        with pytest.raises(StoreUnavailable, match="has no id"):
            store.put_bytes("a/b", b"")
    assert (known_identity(used), store.identity()) == (None, None)
    LocalStore(tmp_path / "store").put_bytes("scenes/ball.zip", b"")
    identify_store(used, store)
    store.put_bytes("a/b", b"")


def test_a_new_store_is_taken_on_purpose(database: Database, tmp_path: Path) -> None:
    identify_store(database, LocalStore(tmp_path / "lost"))
    store = LocalStore(tmp_path / "new")
    identify_store(database, store)
    with pytest.raises(StoreUnavailable):
        store.folders()
    assert adopt_store(database, store) == store.identity() == known_identity(database)
    assert store.folders() == []
