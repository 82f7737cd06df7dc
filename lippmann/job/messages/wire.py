"""The names that service and worker meet under on Redis, and the times they agree on.

Redis only carries: everything under these names may be wiped at any moment and the jobs still end right.
"""

from __future__ import annotations

from lippmann.job.messages.orders import TaskKind

PREFIX = "lippmann:"
EVENTS_STREAM = PREFIX + "events"
EVENTS_KEPT = 200_000
"""About how many events the stream keeps; a beat of 2,000 slots fills it in 8 minutes."""

MARKER = PREFIX + "broker"
"""There as long as the broker remembers; gone when it was wiped."""

QUEUE = "lippmann"
CARRIER_PREFIX = PREFIX + "celery:"
"""What Celery puts before every key of its own; both sides must say the same."""

BEAT_S = 5.0
"""How often an attempt at work beats, and a worker says that it is there."""
PRESENCE_TTL_S = 20.0
LEASE_TTL_S = 45.0
"""An attempt silent for this long is lost."""
UNCLAIMED_S = 60.0
"""A dispatched order that nobody claims for this long goes back."""
STOP_TTL_S = 86_400.0
STOP_POLL_S = 1.0
"""How often an attempt at work looks whether it should stop."""


def broker_url(redis_url: str) -> str:
    """Return a Redis address as Celery writes it.

    >>> broker_url("unix:///run/lippmann.sock?db=0")
    'redis+socket:///run/lippmann.sock?virtual_host=0'
    """
    if not redis_url.startswith("unix://"):
        return redis_url
    return redis_url.replace("unix://", "redis+socket://", 1).replace("?db=", "?virtual_host=")


def task_name(kind: TaskKind) -> str:
    """Return the Celery task that does this kind of work."""
    return f"lippmann.{kind.value}"


def lease_key(attempt: str) -> str:
    """Return the key that holds which worker has an attempt."""
    return f"{PREFIX}lease:{attempt}"


def stop_key(attempt: str) -> str:
    """Return the key whose presence tells an attempt to stop."""
    return f"{PREFIX}stop:{attempt}"


def presence_key(worker: str) -> str:
    """Return the key of a worker's `Presence`."""
    return f"{PREFIX}worker:{worker}"
