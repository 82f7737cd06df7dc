"""The broker of the settings: its certificate, the password and rights of the user, and how well it keeps orders."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing

from redis.exceptions import AuthenticationError, NoPermissionError, RedisError, ResponseError

from lippmann.broker_settings import BrokerSettings
from lippmann.errors import BadInput
from lippmann.job.messages.events import Presence
from lippmann.job.messages.seals import Seals
from lippmann.job.messages.worker_keys import KEY_REFUSED
from service.broker_stream import Stream, evicting_text
from service.db.engine import Database
from service.doctor.finding import Check, Finding, Level
from service.errors import BrokerUnavailable
from service.health import version_note
from service.settings import Settings
from service.worker_keys.registry import WorkerKeys

_REFUSALS = (AuthenticationError, NoPermissionError, ResponseError)
ANSWER_S = 2.0
_INVALID_CERTIFICATE = "CERTIFICATE_VERIFY_FAILED"


def check_broker(settings: Settings, database: Database) -> Iterator[Finding]:
    """Yield what is wrong with the way to the broker, if the settings name one, and the workers with refused keys.

    A broker that does not answer is only a note, since a farm that is examined need not run.
    """
    keys = WorkerKeys(database, needed=settings.workers_need_keys)
    yield from _examine(settings, lambda: keys.seals(settings), _examine_as_service)


def check_broker_of_worker(settings: BrokerSettings) -> Iterator[Finding]:
    """Yield what is wrong with the way of a worker to the broker, whose user has fewer rights; see `check_broker`."""
    yield from _examine(settings, lambda: settings.seals, _examine_as_worker)


def _examine(
    settings: BrokerSettings, seals: Callable[[], Seals], examine: Callable[[Stream], Iterable[Finding]]
) -> Iterator[Finding]:
    if "redis_url" not in settings.model_fields_set:
        return
    try:
        url, known = settings.broker, seals()
    except BadInput as error:
        yield Finding(Check.BROKER, Level.ERROR, error.message)
        return
    with closing(Stream(url, seals=known, timeout_s=ANSWER_S)) as stream:
        try:
            yield from examine(stream)
        except BrokerUnavailable as error:
            cause = error.__cause__
            is_refused = isinstance(cause, _REFUSALS) or _INVALID_CERTIFICATE in str(cause)
            level = Level.ERROR if is_refused and isinstance(cause, RedisError) else Level.NOTE
            yield Finding(Check.BROKER, level, " ".join(error.args[0].split()))


def _check_workers(workers: Iterable[Presence]) -> Iterator[Finding]:
    """Yield the workers of another release; those that get no orders because of it are a warning."""
    for worker in workers:
        if (note := version_note(worker)) is not None:
            yield Finding(Check.WORKERS, Level.NOTE if worker.understands() else Level.WARNING, note)


def _refused_workers(workers: Iterable[Presence], refused_keys: Iterable[str]) -> Iterator[Finding]:
    """Yield the workers whose keys are refused, and the keys of those that have ended since."""
    present = set()
    for worker in workers:
        if worker.fault is not None and worker.fault.code == KEY_REFUSED:
            present.add(worker.worker_key)
            message = f"worker {worker.name} on {worker.host} is refused: {worker.fault.message}"
            yield Finding(Check.WORKERS, Level.WARNING, message)
    for key_id in sorted(set(refused_keys) - present):
        message = f"workers with the key {key_id}, which was revoked or has expired, were refused in the last minute"
        yield Finding(Check.WORKERS, Level.NOTE, message)


def _examine_as_worker(stream: Stream) -> Iterable[Finding]:
    stream.ping()
    return ()


def _examine_as_service(stream: Stream) -> Iterator[Finding]:
    stream.first_order()
    workers = stream.presences()
    yield from _check_workers(workers)
    yield from _refused_workers(workers, stream.refused_keys())
    keeping = stream.keeping()
    if keeping is None:
        text = "the user of the broker has no right to INFO, so that it is not known whether the broker keeps orders"
        yield Finding(Check.BROKER, Level.NOTE, text)
        return
    if keeping.evicts:
        yield Finding(Check.BROKER, Level.ERROR, evicting_text(keeping.evicts))
    if not keeping.has_append_only_file:
        text = (
            "a restart of the broker loses orders and events, which the farm then sends and makes again: expected "
            "appendonly yes, got no"
        )
        yield Finding(Check.BROKER, Level.WARNING, text)
