"""The names of queues, streams and keys on Redis, and the intervals that service and workers rely on.

Redis only carries messages: everything under these names may be deleted at any moment, and every job still completes.
"""

from __future__ import annotations

import hashlib
from urllib.parse import parse_qsl, quote, urlencode, urlsplit, urlunsplit

from lippmann.job.messages.orders import TaskKind

PREFIX = "lippmann:"
EVENTS_STREAM = PREFIX + "events"
EVENTS_KEPT = 200_000
"""The approximate number of events that the stream keeps; the heartbeats of 2,000 slots fill it in 8 minutes."""

MARKER = PREFIX + "broker"
"""A key that exists until the broker is wiped."""

QUEUE = "lippmann"
"""The queue of the jobs that ask for no particular worker; see `queue_of` for the others."""
CARRIER_PREFIX = PREFIX + "celery:"
"""The prefix of all keys of Celery, which both sides must configure alike."""

HEARTBEAT_S = 5.0
"""The interval of the heartbeats of a running attempt, and of the presence of a worker."""
PRESENCE_TTL_S = 15.0
"""The time after which the presence of a worker expires, three times the interval at which it is published."""
LEASE_TTL_S = 15.0
"""The time after which a lease expires. An attempt renews its lease every `STOP_POLL_S`, so a process that stands still
for 10 s keeps it."""
SILENCE_S = 45.0
"""The time without a heartbeat after which an attempt is lost, whatever else is known of it."""
UNCLAIMED_S = 60.0
"""The time after which a dispatched order that no worker claims is taken back."""
STOP_TTL_S = 86_400.0
STOP_POLL_S = 1.0
"""The interval at which a running attempt renews its lease and checks whether it must stop."""


NOT_CLAIMING = PREFIX + "not-claiming"
"""The key of the workers that take no orders, by the judgement of the coordinator."""
NOT_CLAIMING_TTL_S = 10.0

DIRECTIONS = PREFIX + "directions"
"""The key of the `Directions` of the coordinator, which workers read."""
DIRECTIONS_S = 5.0
"""The interval at which the directions are published if they do not change."""

PREVIEWS = PREFIX + "preview:"
"""The prefix of all keys of previews. Each of them expires."""
PREVIEW_TTL_S = 60.0
"""The time after which the orders and answers of previews expire that nobody takes."""


def queue_of(requirement: str) -> str:
    """Return the queue of the orders of jobs with a requirement, which is given as `JobRequirement.text`.

    >>> queue_of("")
    'lippmann'
    >>> queue_of('{"pool":"night"}')
    'lippmann.fdf141d1076cb343'
    """
    return f"{QUEUE}.{hashlib.sha256(requirement.encode()).hexdigest()[:16]}" if requirement else QUEUE


def full_redis_url(redis_url: str, *, password: str = "", ca_file: str = "") -> str:
    """Return the URL of a Redis server with a password, and with the certificates that sign the server's own.

    >>> full_redis_url("rediss://lippmann@redis:6379/0", password="a/b", ca_file="/run/ca.pem")
    'rediss://lippmann:a%2Fb@redis:6379/0?ssl_ca_certs=%2Frun%2Fca.pem'
    >>> full_redis_url("unix:///run/lippmann.sock", password="secret")
    'unix://:secret@/run/lippmann.sock'
    """
    if not password and not ca_file:
        return redis_url
    parts = urlsplit(redis_url)
    if password:
        user, place = parts.username or "", parts.netloc.rpartition("@")[2]
        parts = parts._replace(netloc=f"{user}:{quote(password, safe='')}@{place}")
    if ca_file and parts.scheme == "rediss":
        parts = parts._replace(query=_with_query(parts.query, ssl_ca_certs=ca_file))
    return urlunsplit(parts)


def broker_url(redis_url: str) -> str:
    """Return the address of a Redis server in the form that Celery expects.

    >>> broker_url("unix:///run/lippmann.sock?db=0")
    'redis+socket:///run/lippmann.sock?virtual_host=0'
    >>> broker_url("rediss://redis:6379/0")
    'rediss://redis:6379/0?ssl_cert_reqs=CERT_REQUIRED'
    """
    if redis_url.startswith("rediss://"):
        # Without this, Celery's transport takes the server for one without TLS.
        parts = urlsplit(redis_url)
        query = (
            parts.query if "ssl_cert_reqs" in parts.query else _with_query(parts.query, ssl_cert_reqs="CERT_REQUIRED")
        )
        return urlunsplit(parts._replace(query=query))
    if not redis_url.startswith("unix://"):
        return redis_url
    return redis_url.replace("unix://", "redis+socket://", 1).replace("?db=", "?virtual_host=")


def _with_query(query: str, **added: str) -> str:
    return urlencode([*parse_qsl(query), *added.items()])


def task_name(kind: TaskKind) -> str:
    """Return the name of the Celery task for a kind of task."""
    return f"lippmann.{kind.value}"


def lease_key(attempt: str) -> str:
    """Return the key of an attempt's `Lease`."""
    return f"{PREFIX}lease:{attempt}"


def stop_key(attempt: str) -> str:
    """Return the key that makes an attempt stop while it exists."""
    return f"{PREFIX}stop:{attempt}"


def presence_key(worker: str) -> str:
    """Return the key of a worker's `Presence`."""
    return f"{PREFIX}worker:{worker}"


def preview_orders_key(worker: str) -> str:
    """Return the key of the list of the `PreviewOrder`s for a worker."""
    return f"{PREVIEWS}orders:{worker}"


def preview_wanted_key(preview: str) -> str:
    """Return the key that exists while the service waits for a preview."""
    return f"{PREVIEWS}wanted:{preview}"


def preview_answer_key(preview: str) -> str:
    """Return the key of the list with the `PreviewAnswer` to a preview."""
    return f"{PREVIEWS}answer:{preview}"


def preview_newest_key(series: str) -> str:
    """Return the key of the id of the newest preview of a series."""
    return f"{PREVIEWS}newest:{series}"
