"""What is remembered. Times are seconds since 1970, UTC, from Python."""

from __future__ import annotations

from enum import StrEnum
from typing import Any

from sqlalchemy import JSON, BigInteger, Double, Enum, ForeignKey, Index, Integer, LargeBinary, String, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from lippmann.job.orders import TaskKind
from lippmann.job.states import JobStatus, TaskStatus


class Chore(StrEnum):
    """Work on a job's rows that is too long for one transaction; the clerk does it in pieces."""

    PLAN = "plan"
    CANCEL = "cancel"
    RETRY = "retry"
    REMOVE = "remove"


class EventTopic(StrEnum):
    """What an event for listeners is about."""

    JOB = "job"
    TASK = "task"
    FRAME = "frame"
    PROGRESS = "progress"


class CredentialKind(StrEnum):
    """What a secret is good for."""

    KEY = "key"
    LOGIN = "login"
    SESSION = "session"


def _word(of: type[StrEnum]) -> Enum:
    return Enum(of, native_enum=False, length=16, values_callable=lambda words: [word.value for word in words])


_number = BigInteger().with_variant(Integer, "sqlite")


class Base(DeclarativeBase):
    """Every table."""

    type_annotation_map = {float: Double, int: BigInteger, dict[str, Any]: JSON, list[str]: JSON}  # noqa: RUF012 - SQLAlchemy reads it from the class


class Scene(Base):
    """A scene that jobs can ask for."""

    __tablename__ = "scenes"

    name: Mapped[str] = mapped_column(String(100), primary_key=True)
    digest: Mapped[str] = mapped_column(String(64))
    card: Mapped[dict[str, Any]]
    builtin: Mapped[bool]
    poster: Mapped[bytes | None] = mapped_column(LargeBinary)
    updated_s: Mapped[float]


class Job(Base):
    """A job: what was asked for, where it stands, and how many of its tasks stand where."""

    __tablename__ = "jobs"
    __table_args__ = (Index("ix_jobs_status", "status"), Index("ix_jobs_chore", "chore"))

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    title: Mapped[str] = mapped_column(String(200))
    scene: Mapped[str] = mapped_column(String(100))
    spec: Mapped[dict[str, Any]]
    notes: Mapped[list[str]]
    owner: Mapped[str] = mapped_column(String(64))
    status: Mapped[JobStatus] = mapped_column(_word(JobStatus))
    chore: Mapped[Chore | None] = mapped_column(_word(Chore))
    priority: Mapped[int]
    created_s: Mapped[float]
    started_s: Mapped[float | None]
    planned_s: Mapped[float | None]
    ended_s: Mapped[float | None]
    probe: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    plan: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    error_code: Mapped[str | None] = mapped_column(String(64))
    error_message: Mapped[str | None] = mapped_column(Text)
    waiting: Mapped[int] = mapped_column(default=0)
    ready: Mapped[int] = mapped_column(default=0)
    dispatched: Mapped[int] = mapped_column(default=0)
    running: Mapped[int] = mapped_column(default=0)
    done: Mapped[int] = mapped_column(default=0)
    failed: Mapped[int] = mapped_column(default=0)
    cancelled: Mapped[int] = mapped_column(default=0)
    frames_total: Mapped[int]
    frames_done: Mapped[int] = mapped_column(default=0)
    total_px: Mapped[int] = mapped_column(default=0)
    done_px: Mapped[int] = mapped_column(default=0)
    cpu_s: Mapped[float] = mapped_column(default=0.0)
    wall_s: Mapped[float] = mapped_column(default=0.0)
    late_events: Mapped[int] = mapped_column(default=0)


class Task(Base):
    """A task of a job. `attempt` is the fence: it names the last attempt, which owns the task while it is held."""

    __tablename__ = "tasks"
    __table_args__ = (
        Index("ix_tasks_job_status", "job_id", "status", "sequence"),
        Index("ix_tasks_job_stage", "job_id", "stage", "status"),
        Index("ix_tasks_job_needs", "job_id", "needs", "status"),
        Index("ix_tasks_job_frame", "job_id", "frame"),
    )

    job_id: Mapped[str] = mapped_column(String(32), ForeignKey("jobs.id"), primary_key=True)
    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    kind: Mapped[TaskKind] = mapped_column(_word(TaskKind))
    stage: Mapped[str] = mapped_column(String(32))
    needs: Mapped[str | None] = mapped_column(String(32))
    frame: Mapped[int | None]
    tile_row: Mapped[int | None]
    tile_col: Mapped[int | None]
    output: Mapped[str | None] = mapped_column(String(64))
    artifact: Mapped[str] = mapped_column(String(200))
    weight_px: Mapped[int]
    status: Mapped[TaskStatus] = mapped_column(_word(TaskStatus))
    attempt: Mapped[str | None] = mapped_column(String(32))
    attempt_number: Mapped[int] = mapped_column(default=0)
    failures: Mapped[int] = mapped_column(default=0)
    failed_on: Mapped[list[str]] = mapped_column(default=list)
    rests: Mapped[int] = mapped_column(default=0, server_default="0")
    worker: Mapped[str | None] = mapped_column(String(200))
    progress: Mapped[float | None]
    not_before_s: Mapped[float | None]
    dispatched_s: Mapped[float | None]
    dispatched_idle_s: Mapped[float | None]
    claimed_s: Mapped[float | None]
    beat_s: Mapped[float | None]
    ended_s: Mapped[float | None]
    cpu_s: Mapped[float | None]
    wall_s: Mapped[float | None]
    error_code: Mapped[str | None] = mapped_column(String(64))
    error_message: Mapped[str | None] = mapped_column(Text)
    permanent: Mapped[bool] = mapped_column(default=False)


class WorkerFault(Base):
    """How often a worker failed tasks of a job, and until when it is avoided for that."""

    __tablename__ = "worker_faults"

    job_id: Mapped[str] = mapped_column(String(32), ForeignKey("jobs.id"), primary_key=True)
    worker: Mapped[str] = mapped_column(String(200), primary_key=True)
    failures: Mapped[int] = mapped_column(default=0)
    until_s: Mapped[float | None]


class JobEvent(Base):
    """What listeners hear; ids rise in the order in which events become visible."""

    __tablename__ = "job_events"
    __table_args__ = (Index("ix_job_events_job", "job_id", "id"), {"sqlite_autoincrement": True})

    id: Mapped[int] = mapped_column(_number, primary_key=True, autoincrement=True)
    job_id: Mapped[str] = mapped_column(String(32))
    topic: Mapped[EventTopic] = mapped_column(_word(EventTopic))
    data: Mapped[dict[str, Any]]


class StoppedAttempt(Base):
    """An attempt that must hear that it should stop; the clerk tells the broker."""

    __tablename__ = "stopped_attempts"

    attempt: Mapped[str] = mapped_column(String(32), primary_key=True)
    at_s: Mapped[float]


class ClerkRow(Base):
    """One row: who leads, how far the stream was followed, and how long slots stood idle."""

    __tablename__ = "clerk"

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=False)
    leader: Mapped[str | None] = mapped_column(String(100))
    until_s: Mapped[float] = mapped_column(default=0.0)
    position: Mapped[str] = mapped_column(String(64), default="0-0")
    idle_s: Mapped[float] = mapped_column(default=0.0)


class Credential(Base):
    """A key, a login token or a browser session; of the secret only its SHA-256."""

    __tablename__ = "credentials"
    __table_args__ = (Index("ix_credentials_kind", "kind"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    kind: Mapped[CredentialKind] = mapped_column(_word(CredentialKind))
    name: Mapped[str] = mapped_column(String(100))
    role: Mapped[str] = mapped_column(String(16))
    secret_sha256: Mapped[str] = mapped_column(String(64))
    parent: Mapped[str | None] = mapped_column(String(32))
    created_s: Mapped[float]
    expires_s: Mapped[float | None]


class IdempotencyKey(Base):
    """A submit that may be said again."""

    __tablename__ = "idempotency_keys"

    caller: Mapped[str] = mapped_column(String(64), primary_key=True)
    key: Mapped[str] = mapped_column(String(200), primary_key=True)
    fingerprint: Mapped[str] = mapped_column(String(64))
    job_id: Mapped[str] = mapped_column(String(32))
    created_s: Mapped[float]
