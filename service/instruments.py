"""The counters and measurements of this process about itself, for Prometheus; see `service.metrics` for the rest.

Several processes of the service each have figures of their own, and Prometheus adds them up. A counter of the
coordinator grows in the process that leads. Labels have few values: nothing that a client sends is one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import StrEnum
from time import perf_counter

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Histogram,
    PlatformCollector,
    ProcessCollector,
    disable_created_metrics,
)

disable_created_metrics()  # type: ignore[no-untyped-call]  # half of all samples would be times that nobody reads
PROCESS = CollectorRegistry()
"""The figures of this process."""
ProcessCollector(registry=PROCESS)
PlatformCollector(registry=PROCESS)


class Outcome(StrEnum):
    """The end of an attempt."""

    DONE = "done"
    FAILED = "failed"
    LOST = "lost"
    """Its process died, or nothing was heard of it any more."""
    DEFERRED = "deferred"
    """A disk, the store, the sandbox or a missing program prevented it."""
    DECLINED = "declined"
    STOPPED = "stopped"


class Refusal(StrEnum):
    """The rate for which a request was refused."""

    KEY = "key"
    ADDRESS = "address"
    LOGIN = "login"
    STREAMS = "streams"


class Delivery(StrEnum):
    """The end of an attempt to deliver a webhook."""

    DELIVERED = "delivered"
    FAILED = "failed"
    """It is tried again."""
    GIVEN_UP = "given-up"


REQUEST_S = Histogram(
    "lippmann_http_request_duration_seconds",
    "The time until the answer to a request begins, by method, route and class of the status.",
    ("method", "route", "status"),
    registry=PROCESS,
)
_TRANSACTION_S = Histogram(
    "lippmann_database_transaction_duration_seconds",
    "The time of a transaction; that of a writing one includes the wait for its turn.",
    ("kind",),
    buckets=(0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0),
    registry=PROCESS,
)
LOOP_LAG_S = Histogram(
    "lippmann_event_loop_lag_seconds",
    "The time by which the event loop was late, measured twice a second.",
    buckets=(0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0),
    registry=PROCESS,
)
_REFUSED = Counter(
    "lippmann_requests_refused", "Requests that were refused because a rate was exceeded.", ("rate",), registry=PROCESS
)
ORDERS = Counter("lippmann_orders_sent", "Orders that the coordinator of this process sent.", registry=PROCESS)
_ATTEMPTS = Counter(
    "lippmann_attempts", "Attempts whose end the coordinator of this process recorded.", ("outcome",), registry=PROCESS
)
_WEBHOOKS = Counter(
    "lippmann_webhook_attempts", "Attempts of this process to deliver a webhook.", ("result",), registry=PROCESS
)

# A counter that is not there until it first grows has no growth that an alert could see.
_REFUSALS = {each: _REFUSED.labels(each.value) for each in Refusal}
_OUTCOMES = {each: _ATTEMPTS.labels(each.value) for each in Outcome}
_DELIVERIES = {each: _WEBHOOKS.labels(each.value) for each in Delivery}
_READ_S, _WRITE_S = _TRANSACTION_S.labels("read"), _TRANSACTION_S.labels("write")


def count_refusal(refusal: Refusal) -> None:
    """Count a request that was refused."""
    _REFUSALS[refusal].inc()


def count_attempts(outcomes: Mapping[Outcome, int]) -> None:
    """Count attempts that ended, once this is committed."""
    for outcome, count in outcomes.items():
        _OUTCOMES[outcome].inc(count)


def count_delivery(result: Delivery) -> None:
    """Count an attempt to deliver a webhook."""
    _DELIVERIES[result].inc()


@contextmanager
def timed_transaction(*, writes: bool) -> Iterator[None]:
    """Measure a transaction."""
    begun_s = perf_counter()
    try:
        yield
    finally:
        (_WRITE_S if writes else _READ_S).observe(perf_counter() - begun_s)
