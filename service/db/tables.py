"""The tables. Times are seconds since 1970, UTC, set by Python and not by the database."""

from __future__ import annotations

import json
from enum import StrEnum
from functools import lru_cache
from typing import Any

from sqlalchemy import (
    JSON,
    BigInteger,
    Double,
    Enum,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    String,
    Text,
    false,
    text,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from lippmann.job.messages.orders import TaskKind, TileIndex
from lippmann.job.spec import JobSpec
from lippmann.job.states import JobStatus, PausedBy, TaskStatus
from service.schemas.events import EventTopic


class BackgroundJob(StrEnum):
    """Work on the rows of a job that is too long for one transaction; the coordinator does it in chunks."""

    PLAN = "plan"
    CANCEL = "cancel"
    RETRY = "retry"
    REMOVE = "remove"
    REPAIR = "repair"
    """Damaged artifacts that failures name are made again."""
    VERIFY = "verify"
    """Every artifact is verified, and the damaged ones are made again."""


class CredentialKind(StrEnum):
    """The purpose of a secret."""

    KEY = "key"
    LOGIN = "login"
    SESSION = "session"
    WORKER = "worker"


ADMIN_OWNER = "admin"
"""The owner of the admin key that the service makes, and of everything that earlier releases stored."""


def _enum(of: type[StrEnum]) -> Enum:
    return Enum(of, native_enum=False, length=16, values_callable=lambda members: [member.value for member in members])


def _partial_index(name: str, *columns: str, where: str) -> Index:
    """Return an index of some rows. A query uses it only if it contains the condition, with its values as literals."""
    return Index(name, *columns, sqlite_where=text(where), postgresql_where=text(where))


_number = BigInteger().with_variant(Integer, "sqlite")


class Base(DeclarativeBase):
    """The base class of all tables."""

    type_annotation_map = {float: Double, int: BigInteger, dict[str, Any]: JSON, list[str]: JSON}  # noqa: RUF012 - SQLAlchemy reads it from the class


class Scene(Base):
    """A scene that jobs can use."""

    __tablename__ = "scenes"

    name: Mapped[str] = mapped_column(String(100), primary_key=True)
    digest: Mapped[str] = mapped_column(String(64))
    card: Mapped[dict[str, Any]]
    builtin: Mapped[bool]
    owner: Mapped[str] = mapped_column(String(100), default=ADMIN_OWNER, server_default=ADMIN_OWNER)
    owner_id: Mapped[str] = mapped_column(String(100), default=ADMIN_OWNER, server_default=ADMIN_OWNER)
    poster: Mapped[bytes | None] = mapped_column(LargeBinary)
    updated_s: Mapped[float]


class Job(Base):
    """A job: its specification, its status, and the number of its tasks in each status."""

    __tablename__ = "jobs"
    __table_args__ = (
        Index("ix_jobs_status", "status", "id"),
        _partial_index("ix_jobs_background_job", "background_job", where="background_job IS NOT NULL"),
        Index("ix_jobs_bundle", "bundle"),
        _partial_index("ix_jobs_busy", "status", "id", where="dispatched + running > 0"),
        _partial_index("ix_jobs_requirement", "status", "requirement", where="requirement <> ''"),
        # On SQLite, lists are searched, sorted and counted in it, without the rows, which are long there. Batches of
        # events write none of its columns, so it costs them nothing. PostgreSQL reads a list without it as fast, and
        # would write it with every change of a job.
        Index(
            "ix_jobs_listed", "title", "scene", "owner", "owner_id", "shared", "status", "background_job", "priority",
            "frames_total", "id",
        ).ddl_if(dialect="sqlite"),
    )  # fmt: skip

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    title: Mapped[str] = mapped_column(String(200))
    scene: Mapped[str] = mapped_column(String(100))
    bundle: Mapped[str | None] = mapped_column(String(64))
    """The digest of the scene bundle; None for a job of an earlier release until the job file was read."""
    spec: Mapped[dict[str, Any]]
    notes: Mapped[list[str]]
    owner: Mapped[str] = mapped_column(String(64))
    owner_id: Mapped[str] = mapped_column(String(100), default=ADMIN_OWNER, server_default=ADMIN_OWNER)
    shared: Mapped[bool] = mapped_column(default=False, server_default=false())
    """True if everybody with a key sees the job, also where jobs are hidden from other owners."""
    status: Mapped[JobStatus] = mapped_column(_enum(JobStatus))
    background_job: Mapped[BackgroundJob | None] = mapped_column(_enum(BackgroundJob))
    priority: Mapped[int]
    webhook_url: Mapped[str | None] = mapped_column(Text)
    """The URL that gets a message when the job has ended; it may hold a secret, so only its host is shown."""
    webhook_error: Mapped[str | None] = mapped_column(Text)
    farm_webhook_url: Mapped[str | None] = mapped_column(Text)
    """The URL of the farm that gets a message too, as the setting was when the job was submitted."""
    max_slots: Mapped[int | None]
    """The limit `slots` of the key that submitted the job; None if the key has none of its own."""
    max_artifacts_mb: Mapped[int | None]
    """The limit `artifacts_mb` of that key."""
    own_slots: Mapped[int | None]
    """The limit `slots` of the job file; None if the job has none of its own."""
    requirement: Mapped[str] = mapped_column(String(1000), default="", server_default=text("''"))
    """The requirement of the job on its workers, as `JobRequirement.text`; empty if nothing."""
    created_s: Mapped[float]
    started_s: Mapped[float | None]
    planned_s: Mapped[float | None]
    ended_s: Mapped[float | None]
    probe: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    plan: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    error_code: Mapped[str | None] = mapped_column(String(64))
    error_message: Mapped[str | None] = mapped_column(Text)
    paused_by: Mapped[PausedBy | None] = mapped_column(_enum(PausedBy))
    pause_code: Mapped[str | None] = mapped_column(String(64))
    pause_reason: Mapped[str | None] = mapped_column(Text)
    paused_s: Mapped[float | None]
    waiting: Mapped[int] = mapped_column(default=0)
    ready: Mapped[int] = mapped_column(default=0)
    dispatched: Mapped[int] = mapped_column(default=0)
    running: Mapped[int] = mapped_column(default=0)
    done: Mapped[int] = mapped_column(default=0)
    failed: Mapped[int] = mapped_column(default=0)
    cancelled: Mapped[int] = mapped_column(default=0)
    skipped: Mapped[int] = mapped_column(default=0, server_default="0")
    frames_total: Mapped[int]
    frames_done: Mapped[int] = mapped_column(default=0)
    total_px: Mapped[int] = mapped_column(default=0)
    done_px: Mapped[int] = mapped_column(default=0)
    cpu_s: Mapped[float] = mapped_column(default=0.0)
    wall_s: Mapped[float] = mapped_column(default=0.0)
    late_events: Mapped[int] = mapped_column(default=0)
    cache_hits: Mapped[int] = mapped_column(default=0, server_default="0")
    cached_px: Mapped[int] = mapped_column(default=0, server_default="0")
    artifact_bytes: Mapped[int] = mapped_column(default=0, server_default="0")
    """The bytes of the artifacts of its tasks."""

    @property
    def parsed_spec(self) -> JobSpec:
        """The specification as a validated model."""
        return _parsed(json.dumps(self.spec))


class Task(Base):
    """A task of a job.

    `attempt` is the fence: it names the latest attempt, which owns the task while the task is dispatched or running.
    """

    __tablename__ = "tasks"
    __table_args__ = (
        Index("ix_tasks_job_status", "job_id", "status", "sequence"),
        Index("ix_tasks_job_stage", "job_id", "status", "stage"),
        _partial_index("ix_tasks_job_needs", "job_id", "needs", where="status = 'waiting'"),
        Index("ix_tasks_job_frame", "job_id", "frame"),
        _partial_index("ix_tasks_ended", "ended_s", where="ended_s IS NOT NULL"),
    )

    job_id: Mapped[str] = mapped_column(String(32), ForeignKey("jobs.id"), primary_key=True)
    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    kind: Mapped[TaskKind] = mapped_column(_enum(TaskKind))
    stage: Mapped[str] = mapped_column(String(32))
    needs: Mapped[str | None] = mapped_column(String(32))
    frame: Mapped[int | None]
    tile_row: Mapped[int | None]
    tile_col: Mapped[int | None]
    output: Mapped[str | None] = mapped_column(String(64))
    artifact: Mapped[str] = mapped_column(String(200))
    weight_px: Mapped[int]
    status: Mapped[TaskStatus] = mapped_column(_enum(TaskStatus))
    attempt: Mapped[str | None] = mapped_column(String(32))
    attempt_number: Mapped[int] = mapped_column(default=0)
    failures: Mapped[int] = mapped_column(default=0)
    losses: Mapped[int] = mapped_column(default=0, server_default="0")
    failed_on: Mapped[list[str]] = mapped_column(default=list)
    deferrals: Mapped[int] = mapped_column(default=0, server_default="0")
    worker: Mapped[str | None] = mapped_column(String(200))
    instance: Mapped[str | None] = mapped_column(String(32))
    progress: Mapped[float | None]
    not_before_s: Mapped[float | None]
    dispatched_s: Mapped[float | None]
    dispatched_idle_s: Mapped[float | None]
    claimed_s: Mapped[float | None]
    heartbeat_s: Mapped[float | None]
    ended_s: Mapped[float | None]
    cpu_s: Mapped[float | None]
    wall_s: Mapped[float | None]
    error_code: Mapped[str | None] = mapped_column(String(64))
    error_message: Mapped[str | None] = mapped_column(Text)
    error_frame: Mapped[int | None]
    error_artifact: Mapped[str | None] = mapped_column(String(200))
    permanent: Mapped[bool] = mapped_column(default=False)
    digests: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True), deferred=True)
    repairs: Mapped[int] = mapped_column(default=0, server_default="0")
    cached: Mapped[bool] = mapped_column(default=False, server_default=false())
    stored_bytes: Mapped[int] = mapped_column(default=0, server_default="0")
    """The bytes of the artifacts that its last successful attempt stored."""

    @property
    def tile(self) -> TileIndex | None:
        """The tile that the task renders; None for a task that renders none."""
        if self.tile_row is None or self.tile_col is None:
            return None
        return TileIndex(row=self.tile_row, col=self.tile_col)


class EndedAttempt(Base):
    """An attempt that has ended without its task being done; the row of the task has only the latest attempt.

    The rows go with the tasks of their job; no foreign key says so, since a process of the version before knows nothing
    of them when it removes a job.
    """

    __tablename__ = "ended_attempts"

    job_id: Mapped[str] = mapped_column(String(32), primary_key=True)
    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    worker: Mapped[str | None] = mapped_column(String(200))
    claimed_s: Mapped[float]
    ended_s: Mapped[float]
    error_code: Mapped[str | None] = mapped_column(String(64))
    """The code of its error; None if it was stopped."""


class OwnerUsage(Base):
    """The bytes of the artifacts of an owner: the sum over the jobs, which the same transactions change."""

    __tablename__ = "owner_usage"

    owner_id: Mapped[str] = mapped_column(String(100), primary_key=True)
    artifact_bytes: Mapped[int]


class StoredBundle(Base):
    """A scene bundle that an owner has stored. One that was replaced stays while jobs need it."""

    __tablename__ = "stored_bundles"

    owner_id: Mapped[str] = mapped_column(String(100), primary_key=True)
    digest: Mapped[str] = mapped_column(String(64), primary_key=True)
    bytes: Mapped[int]


class WorkerFault(Base):
    """The number of failures of a worker on the tasks of a job, and the time until which the job avoids the worker."""

    __tablename__ = "worker_faults"

    job_id: Mapped[str] = mapped_column(String(32), ForeignKey("jobs.id"), primary_key=True)
    worker: Mapped[str] = mapped_column(String(200), primary_key=True)
    failures: Mapped[int] = mapped_column(default=0)
    avoided_until_s: Mapped[float | None]
    code: Mapped[str | None] = mapped_column(String(64))
    """The code of a failure that is no fault of the task; None if the worker only failed tasks."""
    message: Mapped[str | None] = mapped_column(Text)


class JobEvent(Base):
    """An event of the stream; ids rise in the order in which events become visible."""

    __tablename__ = "job_events"
    __table_args__ = (Index("ix_job_events_job", "job_id", "id"), {"sqlite_autoincrement": True})

    id: Mapped[int] = mapped_column(_number, primary_key=True, autoincrement=True)
    job_id: Mapped[str] = mapped_column(String(32))
    topic: Mapped[EventTopic] = mapped_column(_enum(EventTopic))
    data: Mapped[dict[str, Any]]


class StopRequest(Base):
    """An attempt that must stop; the coordinator puts the signal into the broker and deletes the row."""

    __tablename__ = "stop_requests"

    attempt: Mapped[str] = mapped_column(String(32), primary_key=True)
    requested_s: Mapped[float]


INSTANCE_CHARS = 64
"""The longest name of a start of a worker process that can be drained, characters."""


class Drain(Base):
    """A worker process that takes no further orders, because an admin has drained it."""

    __tablename__ = "drains"

    instance: Mapped[str] = mapped_column(String(INSTANCE_CHARS), primary_key=True)
    worker: Mapped[str] = mapped_column(String(100))
    ends: Mapped[bool]
    """True if the worker ends when it has finished its attempts."""
    since_s: Mapped[float]


class Exclusion(Base):
    """A worker that takes no orders until an admin includes it again, however often it restarts."""

    __tablename__ = "exclusions"

    worker: Mapped[str] = mapped_column(String(100), primary_key=True)
    name: Mapped[str] = mapped_column(String(100))
    """The name of the key of the admin."""
    since_s: Mapped[float]


class WebhookDelivery(Base):
    """A message of a webhook that is not delivered yet; see `service.webhooks`."""

    __tablename__ = "webhook_deliveries"
    __table_args__ = (Index("ix_webhook_deliveries_due", "owner_id", "next_s"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    job_id: Mapped[str] = mapped_column(String(32))
    owner_id: Mapped[str] = mapped_column(String(100))
    url: Mapped[str] = mapped_column(Text)
    body: Mapped[str] = mapped_column(Text)
    created_s: Mapped[float]
    attempts: Mapped[int]
    next_s: Mapped[float]
    """When the next attempt is due; while one is made, when the one after it is."""


class CoordinatorRow(Base):
    """A single row: the leader, the position in the stream of worker events, and the idle clock of the slots."""

    __tablename__ = "coordinator"

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=False)
    leader: Mapped[str | None] = mapped_column(String(100))
    leader_until_s: Mapped[float] = mapped_column(default=0.0)
    stream_position: Mapped[str] = mapped_column(String(64), default="0-0")
    idle_s: Mapped[float] = mapped_column(default=0.0)
    faults: Mapped[list[dict[str, Any]] | None] = mapped_column(JSON(none_as_null=True))
    """The causes that prevent all work of the farm now, first cause first; see `service.schemas.farm.Fault`."""
    store_id: Mapped[str | None] = mapped_column(String(64))
    """The id of the farm's artifact store; None before its first start, and after a restore without artifacts."""
    dropped: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    """The number of messages of workers that the coordinators refused, by their kind."""


class Credential(Base):
    """A key, a login token, a browser session or a worker key; only the SHA-256 of the secret is stored.

    Keys with the same `owner_id` own the same jobs and scenes. A key that names no owner is its own.
    """

    __tablename__ = "credentials"
    __table_args__ = (Index("ix_credentials_kind", "kind"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    kind: Mapped[CredentialKind] = mapped_column(_enum(CredentialKind))
    name: Mapped[str] = mapped_column(String(100))
    role: Mapped[str] = mapped_column(String(16))
    owner_id: Mapped[str] = mapped_column(String(100), default=ADMIN_OWNER, server_default=ADMIN_OWNER)
    secret_sha256: Mapped[str] = mapped_column(String(64))
    parent: Mapped[str | None] = mapped_column(String(32))
    created_s: Mapped[float]
    expires_s: Mapped[float | None]
    used_s: Mapped[float | None]
    limits: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    next_sha256: Mapped[str | None] = mapped_column(String(64))
    """The token that replaces the one of a session as soon as the browser has sent it."""
    next_s: Mapped[float | None]
    """When that token was made."""
    old_sha256: Mapped[str | None] = mapped_column(String(64))
    """The token of a session that was replaced last."""
    renewed_s: Mapped[float | None]
    """When it was replaced; None if the session still has its first token."""
    has_broker_user: Mapped[bool] = mapped_column(default=False, server_default=false())
    """True if the worker key has a user of its own at the broker, which ends with the key."""
    revoked_s: Mapped[float | None]
    """When the worker key was revoked; the row is deleted as soon as its user at the broker is gone."""


class AuditRow(Base):
    """A change that somebody made through the API; rows are only appended, and old ones are deleted."""

    __tablename__ = "audit"
    __table_args__ = (Index("ix_audit_at", "at_s"), {"sqlite_autoincrement": True})

    id: Mapped[int] = mapped_column(_number, primary_key=True, autoincrement=True)
    at_s: Mapped[float]
    key_id: Mapped[str] = mapped_column(String(32))
    name: Mapped[str] = mapped_column(String(100))
    role: Mapped[str] = mapped_column(String(16))
    action: Mapped[str] = mapped_column(String(32))
    subject: Mapped[str] = mapped_column(String(200))
    detail: Mapped[str] = mapped_column(Text)
    address: Mapped[str] = mapped_column(String(100))
    request_id: Mapped[str] = mapped_column(String(64))


class IdempotencyKey(Base):
    """A submission that the client may repeat."""

    __tablename__ = "idempotency_keys"

    caller: Mapped[str] = mapped_column(String(64), primary_key=True)
    key: Mapped[str] = mapped_column(String(200), primary_key=True)
    fingerprint: Mapped[str] = mapped_column(String(64))
    job_id: Mapped[str] = mapped_column(String(32))
    created_s: Mapped[float]


# Validation takes tens of milliseconds for a job with many frames, and a page lists fifty jobs.
@lru_cache(maxsize=2048)
def _parsed(text: str) -> JobSpec:
    return JobSpec.model_validate_json(text)
