"""Check a backup and restore it into an empty farm."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from alembic import command
from sqlalchemy import Connection, inspect
from sqlalchemy.orm import Session

from lippmann.errors import BadInput
from lippmann.plan.artifact_store import ArtifactStore
from service.backup.artifacts import check_artifacts, load_artifacts
from service.backup.files import check_lines
from service.backup.manifest import ARTIFACTS, DATABASE, ArtifactPart, Manifest, read_manifest
from service.backup.reset import reset_running
from service.backup.rows import load_tables, path_of_table
from service.db.engine import Database
from service.db.migrations import alembic_config, revisions

_ALLOWED = frozenset({"farm.lock"})
"""The files that a data folder may hold before a restore: the lock, which `lippmann up` leaves."""


@dataclass(frozen=True)
class Restored:
    """The result of a restore."""

    manifest: Manifest
    revision: str
    """The schema revision of the restored database."""
    taken_back: int
    """The number of tasks that attempts held when the backup was made; they run again."""


def check_backup(backup: Path, *, artifacts: bool) -> Manifest:
    """Check every file of a backup, and return its manifest.

    Raises
    ------
    BadInput
        If the folder is no backup of this or an earlier version, or artifacts are asked for and it has none.
    BackupBroken
        If a file is missing, truncated or altered.
    """
    manifest = read_manifest(backup)
    known = revisions()
    if manifest.revision not in known:
        raise BadInput(
            f"expected a schema revision up to {known[0]}, got {manifest.revision}: a newer version wrote it"
        )
    for name, lines in manifest.tables.items():
        check_lines(path_of_table(backup / DATABASE, name), lines)
    if artifacts and manifest.artifacts is None:
        raise BadInput(f"expected a backup with artifacts, got {backup}, which has none; --no-artifacts restores it")
    if artifacts and manifest.artifacts is not None:
        check_artifacts(backup, manifest.artifacts)
    return manifest


def restore_backup(backup: Path, database: Database, store: ArtifactStore | None) -> Restored:
    """Restore a backup into an empty database and an empty store.

    The database is restored last and in one transaction, so a restore that was interrupted leaves no farm.

    Parameters
    ----------
    store
        The store to which the artifacts are written; None if only the database is restored.

    Raises
    ------
    BadInput
        If the folder is no backup of this or an earlier version, or the database or the store is not empty.
    BackupBroken
        If the backup is truncated or was altered. Then nothing is written.
    """
    manifest = check_backup(backup, artifacts=store is not None)
    check_database(database)
    if store is not None and manifest.artifacts is not None:
        _load_artifacts(store, backup, manifest.artifacts)
    with database.connecting() as connection:
        _check_empty(connection, database)
        command.upgrade(alembic_config(connection), manifest.revision)
        load_tables(connection, backup / DATABASE, manifest.tables)
        command.upgrade(alembic_config(connection), "head")
        with Session(connection, autoflush=False) as session:
            taken_back = reset_running(session, store_id=None if store is None else store.make_identity())
            session.flush()
    return Restored(manifest=manifest, revision=revisions()[0], taken_back=taken_back)


def check_folder(data_dir: Path, *, artifacts: bool) -> None:
    """Check that a data folder holds nothing of another farm.

    Parameters
    ----------
    artifacts
        True if artifacts are to be restored; False if the folder may hold those that the user brought back.

    Raises
    ------
    BadInput
        If the folder holds anything else.
    """
    allowed = _ALLOWED if artifacts else _ALLOWED | {ARTIFACTS}
    found = sorted(path.name for path in data_dir.iterdir() if path.name not in allowed) if data_dir.exists() else []
    if found:
        raise BadInput(f"expected an empty data folder, got {data_dir} with {', '.join(found[:5])}")


def check_database(database: Database) -> None:
    """Check that a database is empty. A file that does not exist is, and none is made.

    Raises
    ------
    BadInput
        If it has tables.
    """
    if database.is_sqlite and not Path(database.url.database or "").exists():
        return
    with database.connecting() as connection:
        _check_empty(connection, database)


def _load_artifacts(store: ArtifactStore, backup: Path, part: ArtifactPart) -> None:
    if found := store.list("", limit=1):
        raise BadInput(f"expected an empty artifact store, got one with {found[0].name}")
    try:
        load_artifacts(store, backup, part)
    except BaseException:
        for folder in store.folders():
            store.delete(folder)
        raise


def _check_empty(connection: Connection, database: Database) -> None:
    if tables := inspect(connection).get_table_names():
        named = ", ".join(sorted(tables)[:5]) + (", ..." if len(tables) > 5 else "")
        where = database.url.render_as_string()
        raise BadInput(f"expected an empty database, got {where} with {len(tables)} tables ({named})")
