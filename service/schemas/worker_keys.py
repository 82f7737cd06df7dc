"""Worker keys."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from lippmann.job.rendering.workers import MAX_TAGS, Pool, Tag
from lippmann.join_file import JoinFile
from service.schemas.access import PRINTABLE
from service.schemas.answer import Answer, RequestBody

BrokerUser = Literal["own", "given"]


class WorkerKeyRequest(RequestBody):
    """A request for a new worker key."""

    name: str = Field(min_length=1, max_length=64, pattern=PRINTABLE)
    """The name of the key: the machine that joins with it, or its purpose."""
    expires_in_days: float | None = Field(default=None, gt=0, le=36_500)
    """The time until the key expires; null for a key that does not."""
    pool: Pool = ""
    """The pool of the workers with the key; empty for the setting of the worker."""
    tags: tuple[Tag, ...] = Field(default=(), max_length=MAX_TAGS)
    """The tags of the workers with the key; none for the setting of the worker."""
    broker_user: BrokerUser = "own"
    """`own` for a user of its own at the broker, where the service may make users; otherwise the one of the service
    itself, if this is the default user. `given` for a join file without user and password, which you add."""


class WorkerKey(Answer):
    """A worker key, without its secret."""

    id: str
    name: str
    created_at: datetime
    expires_at: datetime | None
    """The time after which workers with the key are refused; null for a key that does not expire."""
    used_at: datetime | None
    """The time of the last message that a worker signed with the key, exact to a minute; null before the first."""
    has_broker_user: bool
    """True if the key has a user of its own at the broker, whose connections end when the key is revoked."""


class WorkerKeyList(Answer):
    """All worker keys, oldest first."""

    items: tuple[WorkerKey, ...]


class NewWorkerKey(Answer):
    """A new worker key with its join file, which cannot be retrieved later."""

    id: str
    name: str
    expires_at: datetime | None
    has_broker_user: bool
    join: JoinFile
    """The content of the join file: the addresses and secrets that a worker needs."""
