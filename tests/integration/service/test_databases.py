"""SQLite and PostgreSQL: the same form, the same behaviour, one writer at a time."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import update

from lippmann.job.states import JobStatus
from service.api.waits import job_waits, task_waits
from service.db import coordinator as coordinator_rows
from service.db import events as event_rows
from service.db.engine import Database
from service.db.migrations import migrate
from service.db.tables import Base, CoordinatorRow, Job, Task
from service.jobs.commands import cancel_job, retry_job
from service.schemas.events import EventTopic
from service.settings import FailureLimit
from tests.builders_service import SPEC, Farm, claimed, done, failed
from tests.integration.service.conftest import FakeWorker, Service
from tests.waiting import until


@pytest.fixture
def database(url: str) -> Iterator[Database]:
    database = Database(url)
    migrate(database)
    yield database
    database.dispose()


@pytest.fixture
def farm(url: str, tmp_path: Path) -> Iterator[Farm]:
    farm = Farm(url, data_dir=tmp_path)
    yield farm
    farm.database.dispose()


ONLY_SQLITE = {"ix_jobs_listed"}
"""The indexes that PostgreSQL does not have; see `service.db.tables`."""


def test_migrating_an_empty_database_gives_the_tables_of_the_code(database: Database) -> None:
    with database.connecting() as connection:

        def is_here(_item: object, name: str | None, *_: object) -> bool:
            return database.is_sqlite or name not in ONLY_SQLITE

        options = {"compare_type": True, "compare_server_default": True, "include_object": is_here}
        context = MigrationContext.configure(connection, opts=options)
        assert compare_metadata(context, Base.metadata) == []


def test_migrating_again_changes_nothing(database: Database) -> None:
    with database.writing() as session:
        session.execute(update(CoordinatorRow).values(stream_position="7-0"))
    migrate(database)
    with database.reading() as session:
        assert session.query(CoordinatorRow).one().stream_position == "7-0"


def test_services_that_start_together_migrate_once(url: str) -> None:
    databases = [Database(url) for _ in range(4)]
    errors: list[Exception] = []

    def start(database: Database) -> None:
        try:
            migrate(database)
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=start, args=(database,)) for database in databases]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    with databases[0].reading() as session:
        assert session.query(CoordinatorRow).count() == 1
    for database in databases:
        database.dispose()


def test_a_job_lives_the_same_life(farm: Farm) -> None:
    job_id = farm.planned(frames="1-40")
    first, second, *rest = farm.dispatch()
    farm.say(claimed(first), failed(first), claimed(second), done(second))
    with farm.writing() as session:
        cancel_job(session, job_id, now_s=farm.now_s)
    with farm.writing() as session:
        retry_job(session, job_id, now_s=farm.now_s, limit=FailureLimit(0.1, 3))
    farm.say(done(rest[0]))
    farm.work()
    job = farm.job(job_id)
    assert (job.status, job.frames_done, job.late_events, job.done) == (JobStatus.DONE, 40, 1, 122)
    assert job.done_px == job.total_px


def test_writers_wait_for_each_other_and_none_fails(database: Database) -> None:
    """Read, then write what was read: lost updates and deadlocks would show."""
    errors: list[Exception] = []

    def add() -> None:
        try:
            for _ in range(25):
                with database.writing() as session:
                    was = session.get_one(CoordinatorRow, 1).idle_s
                    session.execute(update(CoordinatorRow).values(idle_s=was + 1))
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=add) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    with database.reading() as session:
        assert session.get_one(CoordinatorRow, 1).idle_s == 100


def test_a_listener_never_misses_an_event_that_becomes_visible_late(database: Database) -> None:
    """Ids rise in the order of commits, also when the writer that began first ends last."""
    heard: list[int] = []
    writing, stop = [threading.Thread(target=_announce, args=(database, name)) for name in "abcd"], threading.Event()

    def listen() -> None:
        position = 0
        while True:
            written = stop.is_set()
            with database.reading() as session:
                rows = event_rows.after(session, position, job_id=None, limit=10)
            heard.extend(row.id for row in rows)
            position = rows[-1].id if rows else position
            if written and not rows:
                return

    listener = threading.Thread(target=listen)
    listener.start()
    for thread in writing:
        thread.start()
    for thread in writing:
        thread.join()
    stop.set()
    listener.join()
    assert (len(heard), heard) == (100, sorted(heard))


def _announce(database: Database, name: str) -> None:
    for number in range(25):
        with database.writing() as session:
            event_rows.append(session, [(name, EventTopic.PROGRESS, {"number": number})])


def test_reading_does_not_wait_for_a_writer(database: Database) -> None:
    with database.writing() as writer:
        writer.execute(update(CoordinatorRow).values(idle_s=5))
        with database.reading() as reader:
            assert reader.get_one(CoordinatorRow, 1).idle_s == 0


def test_an_error_in_a_transaction_leaves_nothing(farm: Farm) -> None:
    job_id = farm.submit()

    def half() -> None:
        with farm.writing() as session:
            session.execute(update(Job).values(title="half"))
            raise RuntimeError

    with pytest.raises(RuntimeError):
        half()
    assert farm.job(job_id).title == "ball"


def test_the_write_ahead_log_is_folded_back(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path}/test.db")
    migrate(database)
    log = tmp_path / "test.db-wal"
    assert log.stat().st_size > 0
    database.checkpoint()
    assert log.stat().st_size == 0
    database.dispose()


def test_a_service_on_postgresql_does_a_job(
    postgresql_url: str, make_service: Callable[..., Service], make_worker: Callable[..., FakeWorker]
) -> None:
    service = make_service(database_url=postgresql_url)
    make_worker()
    answer: Any = service.client.post("/jobs", json=SPEC)
    until(lambda: service.status(answer.json()["id"]) == "done")


def test_the_reasons_to_wait_are_computed_on_both_databases(farm: Farm) -> None:
    with farm.writing() as session:
        coordinator_rows.acquire_leadership(session, "me", now_s=farm.now_s, until_s=farm.now_s + 1e6)
    busy = farm.planned(frames="1-10", outputs=[])
    for order in farm.dispatch()[:2]:
        farm.say(claimed(order))
    delayed = farm.submit()
    with farm.writing() as session:
        again = {"not_before_s": farm.now_s + 60, "failures": 1, "error_code": "x", "error_message": "x"}
        session.execute(update(Task).where(Task.job_id == delayed).values(again))
    waiting = farm.submit()
    with farm.database.reading() as session:
        rows = session.query(Job).all()
        of_jobs = {job_id: wait.code for job_id, wait in job_waits(session, rows, farm.outlook()).items()}
        row = session.get_one(Job, busy)
        of_tasks = {wait.code for wait in task_waits(session, row, farm.tasks(busy), farm.outlook()).values()}
    assert of_jobs == {delayed: "retry-delay", waiting: "slots-busy"}
    assert of_tasks == {"order-sent", "fair-share", "earlier-tasks", "earlier-stage"}
