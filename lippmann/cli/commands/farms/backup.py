"""Backup and restore of a farm, and the upgrade of its database."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.options import DATA_DIR, DataDir
from lippmann.errors import BadInput
from lippmann.terminal.output import Output
from lippmann.terminal.progress import utc_text

if TYPE_CHECKING:
    from service.backup.manifest import Manifest

WithArtifacts = Annotated[
    bool,
    typer.Option(
        "--artifacts/--no-artifacts",
        help="Include the artifacts, the files that jobs made. Without them, only the database is written, for "
        "those who back the store up themselves.",
    ),
]


def backup(
    target: Annotated[Path, typer.Argument(metavar="BACKUP", help="The name of the folder to write. It is new.")],
    artifacts: WithArtifacts = True,
    copy: Annotated[
        bool,
        typer.Option(
            "--copy",
            help="Copy every artifact. By default, artifacts on the same file system are hard-linked, which takes no "
            "room, but does not protect against a damaged disk.",
        ),
    ] = False,
    data_dir: DataDir = DATA_DIR,
    *,
    output: Output,
) -> None:
    """Back a farm up, also while it runs. LIPPMANN_DATABASE_URL names the database if it is not in the data folder."""
    from service.backup.write import write_backup
    from service.db.engine import opened
    from service.settings import Settings
    from worker.store.opening import ARTIFACTS, open_store

    settings = Settings(data_dir=data_dir)
    if artifacts and not settings.store_url and not (data_dir / ARTIFACTS).is_dir():
        raise BadInput(f"expected the data folder of a farm, got {data_dir} without {ARTIFACTS}/")
    with opened(settings.database) as database:
        store = open_store(settings) if artifacts else None
        made = write_backup(database, store, target, clock=time.time, link=not copy)
    output.result({"backup": str(target.resolve()), **_data(made)}, f"The backup is {target}: {_text(made)}.")


def restore(
    source: Annotated[Path, typer.Argument(metavar="BACKUP", help="The folder that `lippmann backup` wrote.")],
    artifacts: WithArtifacts = True,
    data_dir: DataDir = DATA_DIR,
    *,
    output: Output,
) -> None:
    """Restore a backup into an empty data folder. LIPPMANN_DATABASE_URL names the database if it is not there."""
    from lippmann.farm.supervisor.folder import data_folder
    from lippmann.private_files import keep_private
    from service.backup.restore import check_backup, check_database, check_folder, restore_backup
    from service.db.engine import opened
    from service.settings import Settings
    from worker.store.opening import open_store

    keep_private()
    settings = Settings(data_dir=data_dir)
    check_backup(source, artifacts=artifacts)
    check_folder(data_dir, artifacts=artifacts)
    # The lock keeps `lippmann up` from starting a farm on a part of the backup.
    with data_folder(data_dir), opened(settings.database, must_exist=False) as database:
        check_database(database)  # A store that is opened makes its folder, and the next restore would be refused.
        done = restore_backup(source, database, open_store(settings) if artifacts else None)
    text = (
        f"The backup is restored into {data_dir}: {_text(done.manifest)}. "
        f"{done.taken_back} tasks that ran at that time run again when a farm starts."
    )
    data = {"data_dir": str(data_dir.resolve()), "tasks_taken_back": done.taken_back, "revision": done.revision}
    output.result({**_data(done.manifest), **data}, text)


def migrate(data_dir: DataDir = DATA_DIR, *, output: Output) -> None:
    """Upgrade the database of a farm to this version. The service does it at its start, too.

    A database that is empty gets its tables. LIPPMANN_DATABASE_URL names the database if it is not in the data folder.
    """
    from lippmann.private_files import keep_private
    from service.db import migrations
    from service.db.engine import opened
    from service.settings import Settings

    keep_private()
    with opened(Settings(data_dir=data_dir).database, must_exist=False) as database:
        migrations.migrate(database)
    newest = migrations.revisions()[0]
    output.result({"revision": newest}, f"The database has the schema of this version, {newest}.")


def _data(manifest: Manifest) -> dict[str, object]:
    part = manifest.artifacts
    return {
        "created_at": utc_text(manifest.created_s),
        "revision": manifest.revision,
        "rows": {name: max(0, lines.lines - 1) for name, lines in manifest.tables.items()},
        "artifacts": None if part is None else {"count": part.count, "bytes": part.bytes},
    }


def _text(manifest: Manifest) -> str:
    jobs, tasks = (manifest.tables[name].lines - 1 for name in ("jobs", "tasks"))
    part = manifest.artifacts
    files = "no artifacts" if part is None else f"{part.count} artifacts of {part.bytes / 1e6:.1f} MB"
    return f"{jobs} jobs with {tasks} tasks, and {files}"
