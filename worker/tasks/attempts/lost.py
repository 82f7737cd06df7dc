"""The end of a pool process that died: its worker reports the attempt in its name, and removes its files."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Mapping
from typing import Any

import structlog
from billiard.exceptions import WorkerLostError
from redis.exceptions import RedisError

from lippmann.job.messages.events import LOST, EventKind, Failure
from lippmann.job.messages.orders import TaskKind
from lippmann.job.messages.seals import Refused
from worker.report import BrokerClient, event_of
from worker.settings import WorkerSettings
from worker.tasks.attempts.sweep import sweep_attempts

log = structlog.get_logger()


def report_if_lost(
    broker: BrokerClient,
    settings: WorkerSettings,
    exception: BaseException | None,
    arguments: Mapping[str, Any] | None,
    *,
    kind: TaskKind,
    attempt: str,
) -> None:
    """Report an attempt as failed if its pool process died, and release its lease; other errors are no news here.

    Parameters
    ----------
    exception
        The error with which Celery ended the task.
    arguments
        The arguments of the task, which hold its order.
    kind, attempt
        The kind and the attempt in the envelope of the order.
    """
    if not isinstance(exception, WorkerLostError):
        return
    try:
        message = (arguments or {}).get("order")
        order = settings.seals.open_order(message, kind=kind, attempt=attempt, now_s=time.time())
    except Refused as error:
        log.warning("a pool process died with an order that cannot be read", error=str(error))
        return
    log.warning(
        "a pool process died", job=order.job_id, task=order.task_id, attempt=order.attempt, error=str(exception)
    )
    failure = Failure(code=LOST, message=f"a process of worker {broker.worker} died: {exception}", permanent=False)
    event = event_of(order, EventKind.FAILED, broker, failure=failure)

    def report() -> None:
        with contextlib.suppress(RedisError):  # the service then notices the silence
            broker.patiently(
                lambda: broker.publish_final(event),
                within_s=settings.final_event_s,
                stopping=settings.stopping_file.exists,
            )

    # The event loop of Celery must go on while the broker does not answer.
    threading.Thread(target=report, name=f"lost-{order.attempt}", daemon=True).start()


def sweep_if_lost(settings: WorkerSettings, exception: BaseException | None) -> None:
    """Remove the scratch folder of an attempt whose pool process died.

    Parameters
    ----------
    exception
        The error with which Celery ended the task.
    """
    if isinstance(exception, WorkerLostError):
        # A folder may hold gigabytes; the event loop of Celery must go on.
        threading.Thread(target=sweep_attempts, args=(settings,), name="sweep-attempts", daemon=True).start()
