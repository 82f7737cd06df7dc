"""Faults of the broker: away, empty, damaged, full."""

from __future__ import annotations

from random import Random

from tests.chaos.kinds.kind import Injection, Kinds, pause
from tests.chaos.parts import Parts
from tests.waiting import until

KINDS = Kinds()


@KINDS.of("broker: killed, starts again with its data", keeps_data=True)
@KINDS.of("broker: killed, starts again empty")
def _broker_killed(parts: Parts, job_id: str, rng: Random) -> None:
    parts.broker.kill()
    pause(rng, 0.0, 5.0)
    parts.broker.start()


@KINDS.of("broker: away for 60 s, starts again empty")
def _broker_away(parts: Parts, job_id: str, rng: Random) -> None:
    parts.broker.kill()
    pause(rng, 58.0, 62.0)
    parts.broker.start()


@KINDS.of("broker: restarted six times, 5 s apart")
def _broker_restarts(parts: Parts, job_id: str, rng: Random) -> None:
    for _ in range(6):
        parts.broker.kill()
        parts.broker.start()
        pause(rng, 4.0, 6.0)


@KINDS.of("broker: stands still for 10 s")
def _broker_stopped(parts: Parts, job_id: str, rng: Random) -> None:
    parts.broker.freeze()
    pause(rng, 9.0, 11.0)
    parts.broker.thaw()


@KINDS.of("broker: stands still for 60 s")
def _broker_stopped_long(parts: Parts, job_id: str, rng: Random) -> None:
    parts.broker.freeze()
    pause(rng, 58.0, 62.0)
    parts.broker.thaw()


@KINDS.of("broker: wiped")
def _wiped(parts: Parts, job_id: str, rng: Random) -> None:
    parts.redis.flushall()


def _deleted(pattern: str) -> Injection:
    def inject(parts: Parts, job_id: str, rng: Random) -> None:
        keys = until(lambda: list(parts.redis.scan_iter(match=pattern)))
        parts.redis.delete(*keys)

    return inject


for _what, _pattern in {
    "all orders": "lippmann:celery:*",
    "the stream of events": "lippmann:events",
    "the leases": "lippmann:lease:*",
    "the presences": "lippmann:worker:*",
    "the marker": "lippmann:broker",
}.items():
    KINDS.add(f"broker: {_what} deleted", _deleted(_pattern))


@KINDS.of("broker: the stream of events trimmed to nothing, ten times")
def _trimmed(parts: Parts, job_id: str, rng: Random) -> None:
    for _ in range(10):
        parts.redis.xtrim("lippmann:events", maxlen=0, approximate=False)
        pause(rng, 0.1, 1.0)


@KINDS.of("broker: every event twice")
def _events_twice(parts: Parts, job_id: str, rng: Random) -> None:
    for _, fields in parts.redis.xrange("lippmann:events"):
        parts.redis.xadd("lippmann:events", fields)


@KINDS.of("broker: every order twice")
def _orders_twice(parts: Parts, job_id: str, rng: Random) -> None:
    queue = "lippmann:celery:lippmann"
    orders = until(lambda: parts.redis.lrange(queue, 0, -1))
    parts.redis.lpush(queue, *orders)


@KINDS.of("broker: out of memory for 15 s")
def _broker_full(parts: Parts, job_id: str, rng: Random) -> None:
    parts.redis.config_set("maxmemory", 1)
    pause(rng, 14.0, 16.0)
    parts.redis.config_set("maxmemory", 0)


@KINDS.of("broker: read-only for 15 s")
def _broker_read_only(parts: Parts, job_id: str, rng: Random) -> None:
    parts.redis.config_set("min-replicas-to-write", 1)
    pause(rng, 14.0, 16.0)
    parts.redis.config_set("min-replicas-to-write", 0)


@KINDS.of("broker: every connection ended, ten times")
def _connections_ended(parts: Parts, job_id: str, rng: Random) -> None:
    for _ in range(10):
        parts.redis.client_kill_filter(_type="normal", skipme=True)
        pause(rng, 0.2, 2.0)
