"""The identity of the artifact store: an id in the store and in the database.

An unmounted disk leaves an empty folder in its place. Without the id, every artifact would seem to be lost, and the
farm would make all of them again, on the wrong disk.
"""

from __future__ import annotations

from sqlalchemy import exists, select

from lippmann.errors import StoreUnavailable
from lippmann.plan.artifact_store import ArtifactStore
from service.db import coordinator as coordinator_rows
from service.db.engine import Database
from service.db.tables import Scene

UNKNOWN = "unknown"
"""An id that no store has: what a farm expects whose store is away and whose id it does not know."""


def identify_store(database: Database, store: ArtifactStore) -> None:
    """Let the store expect the id that the database names; a new farm and a farm without an id take that of the store.

    Raises
    ------
    StoreUnavailable
        If the store does not answer, or if it is empty although the farm has used one.
    """
    expected = known_identity(database)
    if expected is None:
        store.expect(None)
        expected = _new_identity(database, store)
    store.expect(expected)


def known_identity(database: Database) -> str | None:
    """Return the id of the store that the database names."""
    with database.reading() as session:
        return coordinator_rows.store_id(session)


def adopt_store(database: Database, store: ArtifactStore) -> str:
    """Take the store as it is now as the store of this farm, and return its id."""
    store.expect(None)
    identity = store.make_identity()
    was = known_identity(database)
    with database.writing() as session:
        coordinator_rows.adopt_store(session, identity, instead_of=was)
    store.expect(identity)
    return identity


def _new_identity(database: Database, store: ArtifactStore) -> str:
    if store.identity() is None and _has_used_a_store(database) and not store.folders():
        store.expect(UNKNOWN)
        raise StoreUnavailable("cannot use the store: it is empty, and this farm has used one")
    identity = store.make_identity()
    with database.writing() as session:
        coordinator_rows.adopt_store(session, identity, instead_of=None)
    return known_identity(database) or identity


def _has_used_a_store(database: Database) -> bool:
    with database.reading() as session:
        return bool(session.scalar(select(exists().where(Scene.name.is_not(None)))))
