"""A job that an older version began on SQLite ends on PostgreSQL with this one, by a backup of its data."""

from __future__ import annotations

import time
from pathlib import Path

from sqlalchemy import text

from lippmann.job.states import HELD_TASKS, JobStatus, TaskStatus
from service.backup.restore import restore_backup
from service.backup.write import write_backup
from service.db.engine import Database
from service.ports import Parts
from tests.builders_service import FakePictures, FakeScenes, Farm
from tests.integration.lippmann.test_upgrade import NEWEST, unpacked
from worker.store.local import LocalStore


def test_a_job_that_an_older_version_began_on_sqlite_ends_on_postgresql(tmp_path: Path, postgresql_url: str) -> None:
    data, backup = unpacked(NEWEST, tmp_path), tmp_path / "backup"
    old, new = Database(f"sqlite:///{data / 'lippmann.db'}"), Database(postgresql_url)
    with old.reading() as session:
        before = {row.sequence: row for row in session.execute(text("SELECT sequence, status, attempt FROM tasks"))}
    done = {number: row.attempt for number, row in before.items() if row.status == TaskStatus.DONE}
    held = {number for number, row in before.items() if row.status in HELD_TASKS}
    assert done
    assert held
    manifest = write_backup(old, LocalStore(data / "artifacts"), backup, clock=time.time)
    assert manifest.revision == NEWEST
    store = LocalStore(tmp_path / "restored")
    assert restore_backup(backup, new, store).taken_back == len(held)
    old.dispose()
    new.dispose()
    farm = Farm(postgresql_url, given=Parts(store=store, pictures=FakePictures(), scenes=FakeScenes()))
    with farm.database.reading() as session:
        (job_id,) = session.scalars(text("SELECT id FROM jobs"))
    assert farm.work() == len(before) - len(done)
    tasks = {task.sequence: task for task in farm.tasks(job_id)}
    assert farm.job(job_id).status is JobStatus.DONE
    assert {number: tasks[number].attempt for number in done} == done
    farm.database.dispose()
