"""What the environment sets: every name is `LIPPMANN_` and the field in upper case."""

from __future__ import annotations

import logging
import os
from pathlib import Path
from typing import Any

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

from lippmann.job import wire
from lippmann.job.old_names import rename_settings


class Settings(BaseSettings):
    """How this service runs."""

    model_config = SettingsConfigDict(env_prefix="LIPPMANN_", frozen=True, use_attribute_docstrings=True)

    data_dir: Path = Path("data")
    """Where the database and the artifacts lie."""
    database_url: str = ""
    """PostgreSQL as `postgresql+psycopg://...`; SQLite in `data_dir` when empty."""
    redis_url: str = "redis://127.0.0.1:6379/0"
    """The broker."""
    host: str = "127.0.0.1"
    """The address to listen on."""
    port: int = Field(default=8080, ge=0, le=65_535)
    """The port to listen on."""
    public_url: str = ""
    """What users type to get here; `http://host:port` when empty."""
    clerk: bool = True
    """Whether this process may lead: follow events, dispatch and reconcile."""

    tick_s: float = Field(default=0.2, gt=0)
    """How often the clerk looks for work when nothing wakes it."""
    reconcile_s: float = Field(default=5.0, gt=0)
    """How often rows are made right."""
    leader_ttl_s: float = Field(default=10.0, gt=0)
    """A leader silent for longer is replaced."""
    lease_ttl_s: float = Field(default=wire.LEASE_TTL_S, gt=0)
    """An attempt silent for longer is lost."""
    unclaimed_s: float = Field(default=wire.UNCLAIMED_S, gt=0)
    """An order that nobody claims for longer, while a slot is free, goes back."""
    stop_ttl_s: float = Field(default=wire.STOP_TTL_S, gt=0)
    """How long an attempt is remembered as stopped."""
    broker_timeout_s: float = Field(default=2.0, gt=0)
    """The longest that one exchange with the broker may take."""

    orders_per_slot: int = Field(default=2, ge=1)
    """How many orders are out for every slot."""
    failures_allowed: int = Field(default=3, ge=1)
    """A task that fails so often has failed."""
    failed_share: float = Field(default=0.1, gt=0, le=1)
    """A job with a larger share of failed tasks ends."""
    retry_pause_s: float = Field(default=2.0, ge=0)
    """How long a failed task rests before its next attempt; twice as long after the second failure."""
    decline_pause_s: float = Field(default=1.0, ge=0)
    """How long a declined task rests."""
    rest_s: float = Field(default=15.0, gt=0)
    """How long a task rests that failed for the store, the sandbox or POV-Ray: no failure of the task."""
    rests_allowed: int = Field(default=40, ge=0)
    """A task that rested so often fails for that reason after all."""
    avoid_after: int = Field(default=3, ge=1)
    """A worker that fails so many tasks of a job is avoided for that job."""
    avoid_s: float = Field(default=300.0, gt=0)
    """For how long."""

    login_token_s: float = Field(default=900.0, gt=0)
    """How long a login link works."""
    session_s: float = Field(default=30 * 86_400.0, gt=0)
    """How long a browser stays logged in."""
    idempotency_s: float = Field(default=7 * 86_400.0, gt=0)
    """How long an Idempotency-Key is remembered."""
    events_kept: int = Field(default=50_000, ge=1)
    """How many events listeners may catch up on."""
    keepalive_s: float = Field(default=15.0, gt=0)
    """How often an idle stream says that it is alive."""
    body_limit_mb: float = Field(default=256.0, gt=0)
    """The largest request, which is a scene bundle."""
    sheets_mb: float = Field(default=256.0, ge=0)
    """How much memory may hold integral images that people are looking into; the last one stays, whatever its size."""

    def __init__(self, **values: Any) -> None:
        for note in rename_settings(os.environ):
            logging.getLogger(__name__).warning(note)
        super().__init__(**values)

    @property
    def database(self) -> str:
        """The URL of the database."""
        return self.database_url or f"sqlite:///{self.data_dir.resolve() / 'lippmann.db'}"

    @property
    def base_url(self) -> str:
        """What users type to get here."""
        return (self.public_url or f"http://{self.host}:{self.port}").rstrip("/")
