"""Health and workers."""

from __future__ import annotations

from typing import Literal

from service.schemas.answer import Answer


class Part(Answer):
    """A thing that the service needs."""

    ok: bool
    detail: str


class StorePart(Answer):
    """The artifact store."""

    ok: bool
    detail: str
    free_bytes: int | None


class ClerkPart(Answer):
    """Who keeps the jobs going."""

    ok: bool
    leader: str | None
    """Null without a key."""


class Health(Answer):
    """How the farm is."""

    status: Literal["ok", "degraded"]
    version: str
    database: Part
    broker: Part
    store: StorePart
    clerk: ClerkPart
    workers: int | None
    """Null when the broker does not say."""
    slots: int | None


class Worker(Answer):
    """A worker that is there."""

    name: str
    host: str
    pid: int
    slots: int
    sandbox: str
    povray: str
    version: str
    started_s: float
    seen_s: float
    running: int
    """Tasks of open jobs that it runs."""


class WorkerList(Answer):
    """Workers by name; `known` is false when the broker does not say."""

    items: tuple[Worker, ...]
    known: bool
