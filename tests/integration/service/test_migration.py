"""A database of the release before, revision 0002, keeps its data when it is migrated.

`database_0002.sql` is the dump of a database that the release before wrote while a job was running. Four things were
added by hand: a failed output, a background job, a stop request and a worker with failures. The posters were removed.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from sqlalchemy import JSON, Boolean, Connection, MetaData, Table, insert, text

from lippmann.job.states import JobAction, JobStatus
from service.db import coordinator as coordinator_rows
from service.db.counters import miscounted
from service.db.engine import Database
from service.db.migrations import alembic_config, migrate
from service.db.tables import BackgroundJob, Credential, Job, JobEvent, Scene, StopRequest, Task, WorkerFault
from service.events.publish import job_snapshot
from service.schemas.events import EventTopic, StreamMessage
from service.schemas.events import JobEvent as JobMessage

DUMP = Path(__file__).with_name("database_0002.sql")
TABLES = ("scenes", "jobs", "tasks", "worker_faults", "job_events", "stopped_attempts", "clerk", "idempotency_keys")


KEYS = (("k1", "key", "submitter", None), ("s1", "session", "submitter", "k1"), ("k2", "key", "admin", None))
INSERT_KEY = (
    "INSERT INTO credentials (id, kind, name, role, secret_sha256, parent, created_s) "
    "VALUES (:id, :kind, 'somebody', :role, '-', :parent, 1900000000)"
)


@pytest.fixture
def old() -> Iterator[sqlite3.Connection]:
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(DUMP.read_text())
        connection.row_factory = sqlite3.Row
        yield connection


@pytest.fixture
def migrated(url: str, old: sqlite3.Connection) -> Iterator[Database]:
    database = Database(url)
    with database.connecting() as connection:
        command.upgrade(alembic_config(connection), "0002")
        for name in TABLES:
            _copy(old, name, connection)
        for row in KEYS:
            connection.execute(text(INSERT_KEY), dict(zip(("id", "kind", "role", "parent"), row, strict=True)))
    migrate(database)
    yield database
    database.dispose()


def _copy(old: sqlite3.Connection, name: str, connection: Connection) -> None:
    table = Table(name, MetaData(), autoload_with=connection)
    for row in old.execute(f"SELECT * FROM {name}"):
        connection.execute(
            insert(table).values({key: _value(table.c[key].type, value) for key, value in dict(row).items()})
        )


def _value(kind: Any, value: Any) -> Any:
    if isinstance(kind, JSON):
        return None if value is None else json.loads(value)
    return bool(value) if isinstance(kind, Boolean) else value


def test_jobs_and_tasks_are_kept_under_the_new_names(migrated: Database, old: sqlite3.Connection) -> None:
    with migrated.reading() as session:
        (job,) = session.query(Job).all()
        was = old.execute("SELECT * FROM jobs").fetchone()
        assert (job.id, job.status, job.background_job) == (was["id"], JobStatus.RUNNING, BackgroundJob.RETRY)
        assert job.spec == json.loads(was["spec"])
        assert (job.done_px, job.wall_s, job.cpu_s) == (was["done_px"], was["wall_s"], was["cpu_s"])
        assert not miscounted(session)
        tasks = session.query(Task).order_by(Task.sequence).all()
        before = old.execute("SELECT * FROM tasks ORDER BY sequence").fetchall()
        assert [(task.status, task.attempt, task.heartbeat_s, task.deferrals) for task in tasks] == [
            (row["status"], row["attempt"], row["beat_s"], row["rests"]) for row in before
        ]
        assert session.get_one(Scene, "fish").digest == old.execute("SELECT digest FROM scenes").fetchone()["digest"]
        assert job_snapshot(session, job).frames_done == was["frames_done"]


def test_keys_are_their_own_owners_and_what_was_stored_belongs_to_the_admin(migrated: Database) -> None:
    with migrated.reading() as session:
        owners = {row.id: row.owner_id for row in session.query(Credential).all()}
        assert owners == {"k1": "k1", "s1": "k1", "k2": "admin"}
        assert {row.owner_id for row in session.query(Job).all()} == {"admin"}
        assert {(row.owner, row.owner_id) for row in session.query(Scene).all()} == {("admin", "admin")}


def test_the_position_in_the_stream_stop_requests_and_avoided_workers_are_kept(
    migrated: Database, old: sqlite3.Connection
) -> None:
    with migrated.reading() as session:
        row, was = coordinator_rows.current(session), old.execute("SELECT * FROM clerk").fetchone()
        assert (row.leader, row.leader_until_s) == (was["leader"], was["until_s"])
        assert (row.stream_position, row.idle_s) == (was["position"], was["idle_s"])
        assert coordinator_rows.pending_stops(session) == ["00ff00ff00ff00ff00ff00ff"]
        assert session.query(StopRequest).one().requested_s == 1_900_000_000.0
        fault = session.query(WorkerFault).one()
        assert (fault.failures, fault.avoided_until_s) == (2, 1_900_000_300.0)


def test_the_frame_of_a_failure_is_read_once_from_its_message(migrated: Database) -> None:
    with migrated.reading() as session:
        frames = {task.sequence: task.error_frame for task in session.query(Task).all()}
    assert frames.pop(20) == 3
    assert set(frames.values()) == {None}


def test_stored_events_follow_the_schemas_of_the_stream(migrated: Database) -> None:
    with migrated.reading() as session:
        rows = session.query(JobEvent).order_by(JobEvent.id).all()
    messages = [StreamMessage.model_validate({"event": row.topic, "data": row.data}).root for row in rows]
    assert {message.event for message in messages} == set(EventTopic) - {EventTopic.RESET}
    jobs = [message.data for message in messages if isinstance(message, JobMessage)]
    assert all(JobAction.CANCEL in job.actions for job in jobs if not hasattr(job, "removed"))
