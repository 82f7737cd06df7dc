"""Write a backup of a farm, which may be running."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sqlalchemy import Connection, inspect, select, text

from lippmann.errors import BadInput
from lippmann.plan.artifact_store import ArtifactStore
from service.backup.artifacts import dump_artifacts
from service.backup.files import new_folder
from service.backup.manifest import DATABASE, Manifest, write_manifest
from service.backup.rows import dump_tables
from service.db.engine import Database
from service.db.tables import CoordinatorRow
from service.health import package_version


def write_backup(
    database: Database, store: ArtifactStore | None, target: Path, *, clock: Callable[[], float], link: bool = True
) -> Manifest:
    """Write a backup to a new folder, completely or not at all.

    The snapshot of the database is taken first and the artifacts are written afterwards, so every artifact on which
    the snapshot relies is there.

    Parameters
    ----------
    store
        The store whose artifacts are written; None if the backup holds none.
    link
        True if artifacts are linked where that is possible; False if they are always copied.

    Raises
    ------
    BadInput
        If `target` exists, or the database holds no farm.
    StoreUnavailable
        If the store does not answer, or is not that of the farm.
    """
    with new_folder(target) as folder:
        with database.snapshot() as connection:
            # The snapshot begins with its first query, so the time is read before it.
            created_s = clock()
            revision = revision_of(connection)
            if store is not None:
                store.expect(_store_id(connection))
            if revision is None:
                raise BadInput(f"expected the database of a farm, got {database.url.render_as_string()} without one")
            tables = dump_tables(connection, folder / DATABASE)
            job_ids = [str(job_id) for (job_id,) in connection.execute(text("SELECT id FROM jobs ORDER BY id"))]
        artifacts = None if store is None else dump_artifacts(store, folder, job_ids, link=link)
        manifest = Manifest(
            created_s=created_s,
            lippmann=package_version(),
            dialect=database.url.get_backend_name(),
            revision=revision,
            tables=tables,
            artifacts=artifacts,
        )
        write_manifest(folder, manifest)
    return manifest


def _store_id(connection: Connection) -> str | None:
    """Return the id of the store that a database names, which may be of an earlier release."""
    if not inspect(connection).has_table(CoordinatorRow.__tablename__):
        return None
    columns = {column["name"] for column in inspect(connection).get_columns(CoordinatorRow.__tablename__)}
    if CoordinatorRow.store_id.key not in columns:
        return None
    return connection.execute(select(CoordinatorRow.store_id)).scalar()


def revision_of(connection: Connection) -> str | None:
    """Return the schema revision of a database; None if it has none."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    return connection.execute(text("SELECT version_num FROM alembic_version")).scalar()
