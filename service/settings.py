"""The settings of the service, from the environment: `LIPPMANN_` and the name of the field in upper case."""

from __future__ import annotations

import re
from dataclasses import dataclass
from ipaddress import IPv4Network, IPv6Network, ip_network
from pathlib import Path
from typing import Self
from urllib.parse import urlsplit

from pydantic import Field, field_validator, model_validator

from lippmann.broker_settings import BrokerSettings
from lippmann.job.messages import wire
from lippmann.key_file import LINK_KEY_FILE, KeyFile
from lippmann.plan.artifact_store import RESERVE_MB
from service.schemas.access import Role

PATH = re.compile(r"[A-Za-z0-9_~][A-Za-z0-9._~-]*(/[A-Za-z0-9_~][A-Za-z0-9._~-]*)*")
"""A path prefix, without the slash at its begin."""
OWN_PATHS = frozenset({"api", "docs", "help", "static", "login", "logout", "metrics"})
"""The first parts of the paths of the service. A prefix that begins with one would be ambiguous."""
_LOOPBACK = re.compile(r"ws://(localhost|127\.0\.0\.1):\d{1,5}/[A-Za-z0-9._~/-]*")
"""A WebSocket on the machine of whoever opens it."""


@dataclass(frozen=True)
class FailureLimit:
    """The number of failed tasks that ends a job before its other tasks have ended."""

    share: float
    least: int

    def is_exceeded(self, failed: int, total: int) -> bool:
        """Return whether `failed` of `total` tasks are too many.

        >>> FailureLimit(share=0.1, least=3).is_exceeded(2, 19)
        False
        """
        return failed >= self.least and failed > self.share * total


def is_secure_url(url: str) -> bool:
    """Return whether a URL is one of https, or of http on this machine.

    >>> is_secure_url("https://id.example"), is_secure_url("http://id.example"), is_secure_url("http://127.0.0.1:9000")
    (True, False, True)
    """
    try:
        found = urlsplit(url)
        host = found.hostname or ""
    except ValueError:
        return False
    is_here = host in ("localhost", "127.0.0.1", "::1")
    return bool(host) and (found.scheme == "https" or (found.scheme == "http" and is_here))


def _networks(text: str) -> tuple[IPv4Network | IPv6Network, ...]:
    return tuple(ip_network(part.strip()) for part in text.split(",") if part.strip())


class Settings(BrokerSettings):
    """The settings of a service."""

    database_url: str = ""
    """The database: PostgreSQL as `postgresql+psycopg://...`; if empty, SQLite in `data_dir`."""
    link_key_file: Path | None = None
    """The file of the keys from which those of links to artifacts and of webhooks are derived; if empty, `link.key` in
    `data_dir`. The service writes it if it does not exist, and workers have no use for it."""
    workers_need_keys: bool = False
    """True if only workers with a key of their own, which joined by a file, are accepted."""
    host: str = "127.0.0.1"
    """The address to listen on."""
    port: int = Field(default=8080, ge=0, le=65_535)
    """The port to listen on."""
    public_url: str = ""
    """The URL under which users reach the service; if empty, `http://host:port`. Its path, such as `/lippmann`, is the
    one under which a reverse proxy serves it."""
    panel_url: str = ""
    """The address of the bridge of a Looking Glass panel on the machines of users, such as
    `ws://localhost:11222/driver`; the viewer then offers to cast frames to it. If empty, it does not."""
    s3_public_endpoint: str = ""
    """The URL under which users reach the S3 server of the store; if empty, `s3_endpoint`. Clients that ask for it
    download artifacts from there."""
    coordinator: bool = True
    """True if this process may become the leader and run the coordinator."""

    tick_s: float = Field(default=0.2, gt=0)
    """The interval at which the coordinator looks for work when nothing wakes it."""
    reconcile_s: float = Field(default=5.0, gt=0)
    """The interval at which the reconciler runs."""
    leader_ttl_s: float = Field(default=5.0, gt=0)
    """The time after which a silent leader is replaced."""
    lease_ttl_s: float = Field(default=wire.SILENCE_S, gt=0)
    """The time after which a silent attempt is lost."""
    unclaimed_s: float = Field(default=wire.UNCLAIMED_S, gt=0)
    """The time after which an order that no worker claims is taken back; only time with a free slot counts."""
    not_claiming_s: float = Field(default=15.0, gt=0)
    """The time for which an order waits first in the queue before the workers with a free slot are said to take no
    orders; their slots then do not count."""
    stop_ttl_s: float = Field(default=wire.STOP_TTL_S, gt=0)
    """The time for which the broker keeps the stop signal of an attempt."""
    broker_timeout_s: float = Field(default=2.0, gt=0)
    """The longest time of one exchange with the broker."""

    orders_per_slot: int = Field(default=2, ge=1)
    """The number of outstanding orders per slot; tasks of milliseconds get more."""
    failures_allowed: int = Field(default=3, ge=1)
    """The number of failures after which a task has failed."""
    losses_allowed: int = Field(default=10, ge=1)
    """The number of lost attempts after which a task has failed; attempts are lost when their workers are killed."""
    failed_share: float = Field(default=0.1, gt=0, le=1)
    """The share of failed tasks above which a job fails, if at least `failed_least` have failed."""
    failed_least: int = Field(default=3, ge=1)
    """The number of failed tasks below which a job goes on whatever their share, since two of 19 are more than 10 %."""
    retry_pause_s: float = Field(default=2.0, ge=0)
    """The pause before the next attempt of a failed task; it doubles after every failure, up to ten minutes."""
    decline_pause_s: float = Field(default=1.0, ge=0)
    """The pause before the next attempt of a declined task."""
    deferral_s: float = Field(default=15.0, gt=0)
    """The pause before the next attempt of a task that a disk, the store, the sandbox or a missing engine prevented;
    it doubles every time, up to 10 minutes."""
    store_check_s: float = Field(default=15.0, gt=0)
    """The interval at which the coordinator writes a small file to the store to check it."""
    disk_reserve_mb: float = Field(default=RESERVE_MB, ge=0)
    """The free space that artifacts leave on the disk of the store, in megabytes; with less, jobs are paused."""
    database_reserve_mb: float = Field(default=8.0, ge=0)
    """The size of the file that SQLite's disk holds in reserve, in megabytes; it is given up when the disk is full."""
    cache_max_mb: float = Field(default=20_000.0, ge=0)
    """The size of the render cache above which the least recently used entries are removed, in megabytes."""
    cache_max_age_days: float = Field(default=30.0, ge=0)
    """The time after which an unused entry of the render cache is removed, in days."""
    avoid_after: int = Field(default=3, ge=1)
    """The number of failures after which a job avoids a worker."""
    avoid_s: float = Field(default=300.0, gt=0)
    """The time for which a job avoids a worker."""

    max_memory_mb: int = Field(default=65_536, ge=128)
    """The largest `render.memory_mb` of a job, in megabytes."""
    max_timeout_s: float = Field(default=86_400.0, ge=1)
    """The longest time that a job may allow an attempt in all, its parsing, its photons, its stalls and its probe."""
    max_frame_px: int = Field(default=1_100_000_000, ge=1)
    """The largest number of rays of a frame: its pixels, with supersampling, wavelength bands and samples."""
    max_job_px: int = Field(default=100_000_000_000_000, ge=1)
    """The largest number of pixels that are rendered for a job."""
    max_frames: int = Field(default=300_000, ge=1)
    """The largest number of frames of a job."""
    max_tasks: int = Field(default=2_000_000, ge=1)
    """The largest number of tasks of a job. A job with automatic tiles has whole frames instead of tiles above it."""
    max_open_jobs: int = Field(default=5_000, ge=1)
    """The largest number of jobs of one owner that have not ended; above it, submissions are answered with 429."""
    max_open_frames: int = Field(default=3_000_000, ge=1)
    """The largest number of frames in the open jobs of one owner; above it, submissions are answered with 429."""
    max_slots: int = Field(default=100_000, ge=1)
    """The largest number of slots that the jobs of one owner hold at once. An order holds its slot from the time at
    which it is sent."""
    max_scenes: int = Field(default=1_000, ge=1)
    """The largest number of scenes of one owner."""
    max_bundles: int = Field(default=10_000, ge=1)
    """The largest number of scene bundles that one owner stores; bundles that were replaced count."""
    max_bundles_mb: int = Field(default=100_000, ge=1)
    """The largest size of the scene bundles that one owner stores, in megabytes."""
    max_picture_s_per_minute: float = Field(default=120.0, gt=0)
    """The seconds a minute for which pictures on demand of one key are made, in each process of the service, which
    makes two at once; above it, requests are answered with 429."""
    max_artifacts_mb: int = Field(default=10_000_000, ge=1)
    """The size of the artifacts of one owner above which the jobs of the owner are paused and others are refused, in
    megabytes; logs do not count."""
    sharing: bool = True
    """True if everybody with a key sees the jobs and scenes of all owners, which only owners and admins change; if
    False, everybody except admins sees only their own jobs, their own scenes and the built-in ones."""
    audit_days: float = Field(default=365.0, gt=0)
    """The time for which the audit log keeps a change, in days."""
    login_token_s: float = Field(default=900.0, gt=0)
    """The time for which a login link is valid."""
    session_s: float = Field(default=30 * 86_400.0, gt=0)
    """The time after which a browser must log in again, however much it is used."""
    session_idle_s: float = Field(default=7 * 86_400.0, ge=120)
    """The time without a request after which a browser must log in again; a page that is open sends requests."""
    session_renew_s: float = Field(default=3600.0, gt=0)
    """The time after which the token in the cookie of a browser is replaced; the old one is accepted for a minute
    more."""
    oidc_issuer: str = ""
    """The URL of the OpenID provider with whose accounts users log in to the dashboard; if empty, there is no such
    login. It needs the extra `oidc` of the package."""
    oidc_name: str = "OpenID"
    """The name of the provider on the login page."""
    oidc_client_id: str = ""
    """The id of this service at the provider."""
    oidc_client_secret_file: Path | None = None
    """The file of the secret of this service at the provider; if empty, it has none."""
    oidc_scopes: str = "openid profile email"
    """The scopes that a login asks for."""
    oidc_roles_claim: str = "groups"
    """The claim of the ID token with the groups of an account; dots lead to a claim inside others."""
    oidc_roles: dict[str, Role] = Field(default={})
    """The role of each group, as a JSON object such as `{"lab": "submitter", "operators": "admin"}`; of several roles,
    the highest counts."""
    oidc_default_role: Role | None = None
    """The role of accounts without such a group; if empty, they are refused."""
    oidc_session_s: float = Field(default=12 * 3600.0, gt=0)
    """The time after which the provider is asked again; until then an account keeps the role it had at login."""
    webhook_url: str = ""
    """The URL that gets a message about every job that ends, besides the one that a job names; if empty, none."""
    webhook_hosts: str = ""
    """The hosts of your own network to which webhooks may go, separated by commas; all other hosts must have public
    addresses."""
    webhook_http: bool = False
    """True if webhooks may go to `http://` URLs, whose messages everybody on the way can read."""
    webhook_attempts: int = Field(default=8, ge=1)
    """The number of attempts to deliver a webhook."""
    webhook_pause_s: float = Field(default=10.0, gt=0)
    """The pause after the first attempt to deliver a webhook; each is four times as long as the last, up to 6 h."""
    webhook_timeout_s: float = Field(default=10.0, gt=0)
    """The longest time of one attempt to deliver a webhook."""
    link_max_s: float = Field(default=7 * 86_400.0, ge=1)
    """The longest time for which a link to an artifact is valid."""
    idempotency_s: float = Field(default=7 * 86_400.0, gt=0)
    """The time for which an Idempotency-Key is stored."""
    events_kept: int = Field(default=50_000, ge=1)
    """The number of stored events that a subscriber can catch up on."""
    keepalive_s: float = Field(default=15.0, gt=0)
    """The interval at which an idle event stream sends a comment."""
    body_limit_mb: float = Field(default=256.0, gt=0)
    """The largest size of a request, which is a scene bundle."""
    trusted_proxies: str = ""
    """The addresses and networks of reverse proxies, separated by commas; only from them does the service believe
    `X-Forwarded-For` and `X-Forwarded-Proto`, and they have no limit of connections of their own."""
    metrics_token_file: Path | None = None
    """The file of a token, of at least 20 characters, with which a monitor reads `/metrics` and `/api/v1/waiting`
    without a key, also while the database is away; if empty, only a key opens
    them."""
    metrics_networks: str = ""
    """The addresses and networks, separated by commas, from which they are read without a key or a token; if empty,
    none."""
    connections: int = Field(default=4096, ge=1)
    """The largest number of open connections; fewer if the limit of descriptors allows fewer."""
    connections_per_address: int = Field(default=1024, ge=1)
    """The largest number of open connections from one address, at most three quarters of all."""
    request_headers_s: float = Field(default=20.0, gt=0)
    """The time in which the headers of a request must arrive."""
    request_body_s: float = Field(default=30.0, gt=0)
    """The time in which each further 100 kB of the body of a request must arrive."""
    requests_per_minute: int = Field(default=20_000, ge=1)
    """The largest number of requests a minute with one key, in each process of the service."""
    requests_per_minute_by_address: int = Field(default=40_000, ge=1)
    """The largest number of requests a minute from one address, with and without a key."""
    failed_logins_per_minute: int = Field(default=20, ge=1)
    """The number of failed logins a minute from one address above which logins are refused."""
    streams_per_key: int = Field(default=1000, ge=1)
    """The largest number of open event streams of one key or browser session, in each process of the service."""
    sheets_mb: float = Field(default=256.0, ge=0)
    """The memory for integral images that users view; each of the two processes that make pictures keeps its latest
    one whatever its size."""
    picture_memory_mb: int = Field(default=8192, ge=512)
    """The largest address space of a process that makes pictures on demand, in megabytes."""
    picture_timeout_s: float = Field(default=300.0, gt=0)
    """The time after which a picture on demand is given up; the answer is 503."""
    picture_idle_s: float = Field(default=300.0, gt=0)
    """The time without a picture after which a process that makes pictures ends, and its memory is free."""
    preview_timeout_s: float = Field(default=30.0, gt=0, le=60)
    """The time in which a worker must answer a preview, at most 60; then the answer is 503."""
    previews_per_key: int = Field(default=4, ge=1)
    """The largest number of series of previews that one key waits for at once, in each process of the service; above
    it, requests are answered with 429."""
    previews_per_minute: int = Field(default=600, ge=1)
    """The largest number of previews a minute of one key, in each process of the service."""

    @field_validator("public_url")
    @classmethod
    def _check_path(cls, text: str) -> str:
        path = text.rstrip("/").partition("://")[2].partition("/")[2]
        if path and not PATH.fullmatch(path):
            raise ValueError(f"expected a path of letters, digits, '-', '_', '.' and '~', got {path!r}")
        if path.split("/")[0] in OWN_PATHS:
            raise ValueError(f"expected a path that does not begin as one of the service, got {path!r}")
        return text

    @field_validator("panel_url")
    @classmethod
    def _check_panel(cls, text: str) -> str:
        if text and not _LOOPBACK.fullmatch(text):
            raise ValueError(f"expected ws://localhost or ws://127.0.0.1 with a port and a path, got {text!r}")
        return text

    @field_validator("trusted_proxies", "metrics_networks")
    @classmethod
    def _check_networks(cls, text: str) -> str:
        try:
            _networks(text)
        except ValueError:
            raise ValueError(f"expected addresses and networks, such as 10.0.0.0/8, got {text!r}") from None
        return text

    @field_validator("oidc_issuer")
    @classmethod
    def _check_issuer(cls, url: str) -> str:
        if url and not is_secure_url(url):
            raise ValueError(f"expected an https URL, got {url!r}")
        return url

    @model_validator(mode="after")
    def _check_client(self) -> Self:
        if self.oidc_issuer and not self.oidc_client_id:
            raise ValueError("expected LIPPMANN_OIDC_CLIENT_ID beside LIPPMANN_OIDC_ISSUER, got none")
        return self

    @property
    def failure_limit(self) -> FailureLimit:
        """The number of failed tasks that ends a job."""
        return FailureLimit(share=self.failed_share, least=self.failed_least)

    @property
    def proxy_networks(self) -> tuple[IPv4Network | IPv6Network, ...]:
        """The networks of `trusted_proxies`."""
        return _networks(self.trusted_proxies)

    @property
    def metrics_allowed_networks(self) -> tuple[IPv4Network | IPv6Network, ...]:
        """The networks of `metrics_networks`."""
        return _networks(self.metrics_networks)

    @property
    def link_keys(self) -> KeyFile:
        """The keys from which those of links to artifacts and of webhooks are derived."""
        return KeyFile(self.link_key_file or self.data_dir / LINK_KEY_FILE)

    @property
    def disk_reserve_bytes(self) -> int:
        """The free space that artifacts leave on the disk of the store, in bytes."""
        return round(self.disk_reserve_mb * 1e6)

    @property
    def cache_max_bytes(self) -> int:
        """The size of the render cache above which entries are removed, in bytes."""
        return round(self.cache_max_mb * 1e6)

    @property
    def database(self) -> str:
        """The URL of the database."""
        if self.database_url:
            return self.database_url
        path = str(self.data_dir.resolve() / "lippmann.db")
        # SQLAlchemy's own URLs refuse names that are no UTF-8; only these two characters mean something in a path.
        return f"sqlite:///{path.replace('%', '%25').replace('?', '%3F')}"

    @property
    def base_url(self) -> str:
        """The URL under which users reach the service."""
        return (self.public_url or f"http://{self.host}:{self.port}").rstrip("/")

    @property
    def path_prefix(self) -> str:
        """The path of the public URL, which precedes the path of every link; empty without one."""
        return urlsplit(self.base_url).path if "://" in self.base_url else ""
