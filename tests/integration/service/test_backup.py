"""A backup holds what the farm held at one moment, restores into either database, and is refused when it is damaged."""

from __future__ import annotations

import gzip
import json
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from sqlalchemy import select, text, update

from lippmann.digest import Digest
from lippmann.errors import BadInput, StoreUnavailable
from lippmann.job.states import HELD_TASKS, JobStatus, TaskStatus
from lippmann.plan.artifact_store import Moved, unwatched
from service.audit import record
from service.auth import caller_of_key, create_key
from service.backup.files import digest_of, write_lines
from service.backup.manifest import (
    ARTIFACT_LIST,
    ARTIFACTS,
    DATABASE,
    BackupBroken,
    Manifest,
    read_manifest,
    write_manifest,
)
from service.backup.reset import EVENT_GAP
from service.backup.restore import check_folder, restore_backup
from service.backup.rows import dump_tables
from service.backup.write import write_backup
from service.db import access as access_rows
from service.db import coordinator as coordinator_rows
from service.db import events as event_rows
from service.db.counters import miscounted
from service.db.engine import Database
from service.db.migrations import alembic_config, migrate, revisions
from service.db.tables import CoordinatorRow, Job, StopRequest, Task
from service.schemas.access import AuditAction, Role
from service.schemas.events import EventTopic
from service.store_identity import identify_store, known_identity
from tests.builders_service import CALLER, T0, Farm, claimed, done, heartbeat
from tests.integration.lippmann.conftest import run
from tests.integration.service.test_migration import TABLES, _copy
from tests.integration.service.test_migration import old as old
from worker.store.local import LocalStore

KINDS = ("sqlite", "postgresql")


@pytest.fixture
def farm(url: str, tmp_path: Path) -> Iterator[Farm]:
    farm = Farm(url, data_dir=tmp_path)
    yield farm
    farm.database.dispose()


@pytest.fixture(params=KINDS)
def empty_url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Lend the URL of a database that is empty, of each kind."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path}/restored/lippmann.db"
    return new_postgresql(request.getfixturevalue("postgresql"), f"restored_{abs(hash(request.node.nodeid))}")


def new_postgresql(server: str, name: str) -> str:
    import psycopg

    with psycopg.connect(server.replace("+psycopg", "") + "postgres", autocommit=True) as connection:
        connection.execute(f'CREATE DATABASE "{name}"')
    return server + name


@pytest.fixture
def empty(empty_url: str) -> Iterator[Database]:
    database = Database(empty_url)
    yield database
    database.dispose()


@pytest.fixture
def store(tmp_path: Path) -> LocalStore:
    return LocalStore(tmp_path / "store")


def in_mid_job(farm: Farm) -> tuple[str, list[Any]]:
    """Bring a job to its middle: some tasks are done, one runs, others are dispatched."""
    job_id = farm.planned(frames="1-4")
    first, second, *rest = farm.dispatch()
    farm.say(claimed(first), done(first), claimed(second))
    return job_id, [second, *rest]


def back_up(farm: Farm, target: Path, store: LocalStore | None = None) -> Manifest:
    return write_backup(farm.database, store, target, clock=lambda: T0)


def lines_of(backup: Path, table: str) -> bytes:
    with gzip.open(backup / DATABASE / f"{table}.jsonl.gz") as file:
        return file.read()


def test_every_row_comes_back_in_a_database_of_either_kind(farm: Farm, empty: Database, tmp_path: Path) -> None:
    job_id = farm.planned(frames="1-4")
    farm.work()
    queued = farm.submit()
    manifest = back_up(farm, tmp_path / "first")
    assert manifest.revision == revisions()[0]
    assert restore_backup(tmp_path / "first", empty, None).taken_back == 0
    again = write_backup(empty, None, tmp_path / "second", clock=lambda: T0)
    assert set(again.tables) == set(manifest.tables)
    for name in set(manifest.tables) - {"coordinator"}:
        assert lines_of(tmp_path / "first", name) == lines_of(tmp_path / "second", name), name
    with empty.reading() as session:
        assert session.get_one(Job, job_id).status is JobStatus.DONE
        assert session.execute(text("SELECT id FROM jobs WHERE plan IS NULL")).scalars().all() == [queued]


def test_a_restored_farm_knows_its_store_and_no_backup_is_made_of_an_empty_folder(
    farm: Farm, empty: Database, tmp_path: Path
) -> None:
    farm.planned(frames="1-4")
    mine = LocalStore(tmp_path / "mine")
    for name, data in farm.store.files.items():
        mine.put_bytes(name, data)
    identify_store(farm.database, mine)
    back_up(farm, tmp_path / "b", LocalStore(tmp_path / "mine"))
    store = LocalStore(tmp_path / "target")
    restore_backup(tmp_path / "b", empty, store)
    assert known_identity(empty) == store.identity() not in (None, mine.identity())
    with pytest.raises(StoreUnavailable, match="has no id"):
        back_up(farm, tmp_path / "c", LocalStore(tmp_path / "unmounted"))
    assert not (tmp_path / "c").exists()


def test_held_tasks_become_ready_and_nothing_refers_to_processes_of_the_farm_before(
    farm: Farm, empty: Database, tmp_path: Path
) -> None:
    _, held = in_mid_job(farm)
    with farm.writing() as session:
        values = {"leader": "a-1-b", "leader_until_s": T0 + 1e6, "stream_position": "9-9"}
        session.execute(update(CoordinatorRow).values(values))
        coordinator_rows.request_stop(session, [held[0].attempt], now_s=T0)
    back_up(farm, tmp_path / "b")
    assert restore_backup(tmp_path / "b", empty, None).taken_back == len(held)
    with empty.reading() as session:
        assert session.scalars(select(Task).where(Task.status.in_(HELD_TASKS))).all() == []
        assert not miscounted(session)
        row = coordinator_rows.current(session)
        assert (row.leader, row.leader_until_s, row.stream_position) == (None, 0.0, "0-0")
        assert session.query(StopRequest).count() == 0


def test_the_restored_farm_ends_the_job_and_attempts_of_the_farm_before_change_nothing(
    farm: Farm, empty: Database, empty_url: str, tmp_path: Path
) -> None:
    job_id, held = in_mid_job(farm)
    back_up(farm, tmp_path / "b")
    restore_backup(tmp_path / "b", empty, None)
    restored = Farm(empty_url, data_dir=tmp_path)
    restored.store.files |= farm.store.files
    restored.say(heartbeat(held[0]), done(held[0]))
    assert restored.task(held[0].task_id).status is TaskStatus.READY
    with restored.database.reading() as session:
        assert list(coordinator_rows.pending_stops(session)) == [held[0].attempt]
    restored.work()
    job = restored.job(job_id)
    assert (job.status, job.frames_done, job.done, job.late_events) == (JobStatus.DONE, 4, 14, 2)
    assert job.done_px == job.total_px
    restored.database.dispose()


def test_a_snapshot_does_not_see_what_is_written_after_its_first_query(farm: Farm) -> None:
    query = text("SELECT count(*) FROM job_events")
    with farm.database.snapshot() as connection:
        before = connection.execute(query).scalar()
        farm.submit()
        assert connection.execute(query).scalar() == before
    with farm.database.snapshot() as connection:
        assert connection.execute(query).scalar_one() > (before or 0)


def test_keys_remain_valid_and_the_secrets_are_not_in_the_backup(farm: Farm, empty: Database, tmp_path: Path) -> None:
    with farm.writing() as session:
        _, key = create_key(session, "somebody", Role.SUBMITTER)
    back_up(farm, tmp_path / "b")
    restore_backup(tmp_path / "b", empty, None)
    with empty.reading() as session:
        caller = caller_of_key(session, key, now_s=T0)
    assert caller is not None
    assert (caller.name, caller.role) == ("somebody", Role.SUBMITTER)
    assert key.encode() not in lines_of(tmp_path / "b", "credentials")


def test_the_audit_log_is_restored_and_goes_on(farm: Farm, empty: Database, tmp_path: Path) -> None:
    farm.submit()
    back_up(farm, tmp_path / "b")
    restore_backup(tmp_path / "b", empty, None)
    with empty.writing() as session:
        record(session, CALLER, AuditAction.CREATE_KEY, "k2", now_s=T0)
    with empty.reading() as session:
        actions = [
            row.action
            for row in access_rows.audit_page(session, before=None, limit=10, action=None, name=None, subject=None)
        ]
    assert actions == [AuditAction.CREATE_KEY, AuditAction.SUBMIT_JOB]


def test_a_subscriber_of_the_farm_before_receives_the_next_event(farm: Farm, empty: Database, tmp_path: Path) -> None:
    farm.submit()
    back_up(farm, tmp_path / "b")
    with farm.database.reading() as session:
        newest = event_rows.newest(session)
    restore_backup(tmp_path / "b", empty, None)
    with empty.writing() as session:
        event_rows.append(session, [("j", EventTopic.PROGRESS, {})])
    with empty.reading() as session:
        assert event_rows.newest(session) == newest + EVENT_GAP + 1


def test_a_database_of_the_release_before_is_backed_up_and_upgraded_when_it_is_restored(
    url: str, empty: Database, old: Any, tmp_path: Path
) -> None:
    database = Database(url)
    with database.connecting() as connection:
        command.upgrade(alembic_config(connection), "0002")
        for name in TABLES:
            _copy(old, name, connection)
    assert write_backup(database, None, tmp_path / "b", clock=lambda: T0).revision == "0002"
    restored = restore_backup(tmp_path / "b", empty, None)
    assert restored.revision == revisions()[0]
    with empty.reading() as session:
        (job,) = session.query(Job).all()
        assert job.id == old.execute("SELECT id FROM jobs").fetchone()["id"]
        assert not miscounted(session)
        assert coordinator_rows.current(session).stream_position == "0-0"
    database.dispose()


def test_a_backup_of_a_newer_release_is_refused(tmp_path: Path, make_backup: Path) -> None:
    _change_manifest(make_backup, revision="9999")
    with pytest.raises(BadInput, match="9999: a newer version wrote it"):
        restore_backup(make_backup, _nothing(tmp_path), None)


def test_a_refused_restore_leaves_the_folder_for_the_right_backup(tmp_path: Path, make_backup: Path) -> None:
    folder, used = tmp_path / "r1", Database(f"sqlite:///{tmp_path}/used.db")
    migrate(used)
    used.dispose()
    words = ("restore", str(make_backup), "--data-dir", str(folder))
    refused = run(*words, LIPPMANN_DATABASE_URL=f"sqlite:///{tmp_path}/used.db")
    assert (refused.returncode, "expected an empty database" in refused.stderr) == (2, True)
    revision = read_manifest(make_backup).revision
    _change_manifest(make_backup, revision="9999")
    refused = run(*words)
    assert (refused.returncode, "9999: a newer version wrote it" in refused.stderr) == (2, True)
    _change_manifest(make_backup, revision=revision)
    restored = run(*words)
    assert restored.returncode == 0, restored.stderr


def test_a_store_that_is_not_empty_is_refused_before_a_database_is_made(tmp_path: Path, make_backup: Path) -> None:
    target = LocalStore(tmp_path / "target")
    target.put_bytes("scenes/ab.zip", b"PK")
    with pytest.raises(BadInput, match=r"expected an empty artifact store, got one with scenes/ab.zip"):
        restore_backup(make_backup, _nothing(tmp_path), target)
    assert not (tmp_path / "nothing").exists()


@pytest.fixture
def make_backup(tmp_path: Path, store: LocalStore) -> Path:
    """Lend a backup of a SQLite farm in mid-job, with artifacts."""
    farm = Farm(f"sqlite:///{tmp_path}/farm.db", data_dir=tmp_path)
    job_id, _ = in_mid_job(farm)
    store.put_bytes("scenes/ab.zip", b"PK")
    store.put_bytes(f"{job_id}/job.json", b"{}")
    store.put_bytes(f"{job_id}/tiles/0001/00-00.exr", b"light" * 1000)
    store.put_bytes("0m8j90fxypt36e2yq/job.json", b"of a job that the snapshot does not have")
    back_up(farm, tmp_path / "backup", store)
    farm.database.dispose()
    return tmp_path / "backup"


def _nothing(tmp_path: Path) -> Database:
    return Database(f"sqlite:///{tmp_path}/nothing/lippmann.db")


def _change_manifest(backup: Path, **values: Any) -> None:
    manifest = json.loads((backup / "manifest.json").read_text()) | values
    write_manifest(backup, Manifest.model_validate(manifest))


def _sign_artifacts(backup: Path, entries: list[Any]) -> None:
    """Replace the list of artifacts by another one with a digest that is right."""
    (backup / ARTIFACT_LIST).unlink()
    written = write_lines(backup / ARTIFACT_LIST, entries)
    _change_manifest(backup, artifacts={"list": written.model_dump(), "count": len(entries), "bytes": 0})


def test_the_artifacts_of_the_jobs_and_all_bundles_come_back(tmp_path: Path, make_backup: Path) -> None:
    target = LocalStore(tmp_path / "target")
    restore_backup(make_backup, _nothing(tmp_path), target)
    assert [info.name for info in target.list("")] == [
        info.name for info in LocalStore(make_backup / ARTIFACTS).list("")
    ]
    assert len(target.list("")) == 3
    assert target.get_bytes("scenes/ab.zip") == b"PK"


def test_a_link_keeps_the_content_that_the_artifact_had(tmp_path: Path, make_backup: Path, store: LocalStore) -> None:
    store.put_bytes("scenes/ab.zip", b"another")
    target = LocalStore(tmp_path / "target")
    restore_backup(make_backup, _nothing(tmp_path), target)
    assert target.get_bytes("scenes/ab.zip") == b"PK"
    assert (make_backup / ARTIFACTS / "scenes/ab.zip").stat().st_nlink == 1
    (untouched,) = (make_backup / ARTIFACTS).glob("*/job.json")
    assert untouched.stat().st_nlink == 2


def test_copies_share_nothing_with_the_store(tmp_path: Path, store: LocalStore) -> None:
    farm = Farm(f"sqlite:///{tmp_path}/farm.db", data_dir=tmp_path)
    store.put_bytes("scenes/ab.zip", b"PK")
    write_backup(farm.database, store, tmp_path / "copied", clock=lambda: T0, link=False)
    assert (tmp_path / "copied" / ARTIFACTS / "scenes/ab.zip").stat().st_nlink == 1
    farm.database.dispose()


def _files(backup: Path) -> list[Path]:
    return sorted(path for path in backup.rglob("*") if path.is_file())


@pytest.mark.parametrize("damage", ["cut", "flip", "gone"])
def test_a_damaged_backup_is_refused_whichever_file_is_damaged(tmp_path: Path, make_backup: Path, damage: str) -> None:
    assert len(_files(make_backup)) > 10
    for path in _files(make_backup):
        data = path.read_bytes()
        path.unlink()
        if damage == "cut":
            path.write_bytes(data[: len(data) // 2])
        elif damage == "flip":
            half = len(data) // 2
            path.write_bytes(data[:half] + bytes([data[half] ^ 1]) + data[half + 1 :])
        with pytest.raises(BadInput):
            restore_backup(make_backup, _nothing(tmp_path), LocalStore(tmp_path / "target"))
        assert LocalStore(tmp_path / "target").list("") == []
        assert not (tmp_path / "nothing").exists()
        path.unlink(missing_ok=True)
        path.write_bytes(data)
    restore_backup(make_backup, _nothing(tmp_path), LocalStore(tmp_path / "target"))


@pytest.mark.parametrize("name", ["../outside", "/etc/passwd", "a/../../outside", "scenes//x", "link/outside", ".x"])
def test_no_name_in_a_backup_leads_out_of_it(tmp_path: Path, make_backup: Path, name: str) -> None:
    (tmp_path / "outside").write_bytes(b"secret")
    (make_backup / "outside").write_bytes(b"secret")
    (make_backup / ARTIFACTS / "link").symlink_to(tmp_path)
    (make_backup / ARTIFACTS / ".x").write_bytes(b"secret")
    _sign_artifacts(make_backup, [[name, 6, digest_of(tmp_path / "outside")]])
    target = LocalStore(tmp_path / "target")
    with pytest.raises(BackupBroken):
        restore_backup(make_backup, _nothing(tmp_path), target)
    assert target.list("") == []


def test_a_link_in_the_place_of_an_artifact_is_not_followed(tmp_path: Path, make_backup: Path) -> None:
    path = make_backup / ARTIFACTS / "scenes/ab.zip"
    path.rename(tmp_path / "same")
    path.symlink_to(tmp_path / "same")
    with pytest.raises(BackupBroken):
        restore_backup(make_backup, _nothing(tmp_path), LocalStore(tmp_path / "target"))


def test_no_more_is_decompressed_than_was_written(tmp_path: Path, make_backup: Path) -> None:
    manifest = read_manifest(make_backup)
    path = make_backup / DATABASE / "scenes.jsonl.gz"
    path.unlink()
    bomb = write_lines(path, [["x" * 50_000_000]])
    tables = {name: lines.model_dump() for name, lines in manifest.tables.items()}
    _change_manifest(make_backup, tables=tables | {"scenes": {**tables["scenes"], "sha256": bomb.sha256}})
    tracemalloc.start()
    try:
        with pytest.raises(BackupBroken, match=r"expected .* lines of"):
            restore_backup(make_backup, _nothing(tmp_path), None)
        assert tracemalloc.get_traced_memory()[1] < 25_000_000
    finally:
        tracemalloc.stop()


def test_a_restore_that_fails_leaves_an_empty_database_and_store(tmp_path: Path, make_backup: Path) -> None:
    class Failing(LocalStore):
        def put_file(self, name: str, path: Path, *, moved: Moved = unwatched) -> Digest:
            if name.endswith(".exr"):
                raise StoreUnavailable("the disk is gone")
            return super().put_file(name, path, moved=moved)

    target, database = Failing(tmp_path / "target"), _nothing(tmp_path)
    with pytest.raises(StoreUnavailable):
        restore_backup(make_backup, database, target)
    assert target.list("") == []
    database.dispose()
    restore_backup(make_backup, _nothing(tmp_path), LocalStore(tmp_path / "target"))


def test_only_an_empty_database_is_restored_into(farm: Farm, tmp_path: Path) -> None:
    back_up(farm, tmp_path / "b")
    with pytest.raises(BadInput, match=r"expected an empty database, got .* with \d+ tables \(alembic_version, "):
        restore_backup(tmp_path / "b", farm.database, None)


def test_only_an_empty_store_is_restored_into(tmp_path: Path, make_backup: Path) -> None:
    target = LocalStore(tmp_path / "target")
    target.put_bytes("scenes/other.zip", b"PK")
    with pytest.raises(BadInput, match="got one with scenes"):
        restore_backup(make_backup, _nothing(tmp_path), target)
    assert [info.name for info in target.list("")] == ["scenes/other.zip"]


def test_only_an_empty_data_folder_is_restored_into(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    check_folder(folder, artifacts=True)
    folder.mkdir()
    (folder / "farm.lock").touch()
    check_folder(folder, artifacts=True)
    (folder / ARTIFACTS).mkdir()
    check_folder(folder, artifacts=False)
    with pytest.raises(BadInput, match="with artifacts"):
        check_folder(folder, artifacts=True)
    (folder / "broker").mkdir()
    with pytest.raises(BadInput, match="with broker"):
        check_folder(folder, artifacts=False)


def test_a_backup_that_fails_leaves_nothing_and_one_that_exists_is_kept(farm: Farm, tmp_path: Path) -> None:
    class Failing(LocalStore):
        def list(self, *where: Any, **how: Any) -> Any:
            raise StoreUnavailable("the disk is gone")

    before = set(tmp_path.iterdir())
    with pytest.raises(StoreUnavailable):
        back_up(farm, tmp_path / "b", Failing(tmp_path / "failing"))
    assert set(tmp_path.iterdir()) - before == {tmp_path / "failing"}
    back_up(farm, tmp_path / "b")
    with pytest.raises(BadInput, match="which exists"):
        back_up(farm, tmp_path / "b")
    assert (tmp_path / "b").stat().st_mode & 0o077 == 0


def test_a_database_without_a_farm_is_not_backed_up(empty: Database, tmp_path: Path) -> None:
    with empty.connecting():
        pass
    with pytest.raises(BadInput, match="expected the database of a farm"):
        write_backup(empty, None, tmp_path / "b", clock=lambda: T0)


def test_rows_are_written_in_the_order_of_their_keys(farm: Farm, tmp_path: Path) -> None:
    farm.planned(frames="1-4")
    with farm.database.snapshot() as connection:
        written = dump_tables(connection, tmp_path / "dumped")
    with gzip.open(tmp_path / "dumped" / "tasks.jsonl.gz") as file:
        rows = [json.loads(line) for line in file]
    at = rows[0].index("sequence")
    assert [row[at] for row in rows[1:]] == list(range(14))
    assert written["tasks"].lines == 15
