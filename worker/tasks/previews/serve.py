"""The process of a worker that renders previews: it takes one order at a time and answers it.

    python -m worker.tasks.previews.serve PARENT

It ends with its worker, which has the process id PARENT, and when no order has come for `IDLE_S`.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import time
from contextlib import suppress
from types import FrameType

import structlog
from redis.exceptions import RedisError

from lippmann.errors import LippmannError
from lippmann.job.messages.events import Failure
from lippmann.job.messages.previews import PreviewAnswer, PreviewMade, PreviewOrder
from lippmann.logs import configure_logs
from worker.images.read import limit_threads
from worker.preview_orders import PreviewOrders
from worker.sandbox.limits import TimeLimit
from worker.settings import WorkerSettings
from worker.tasks.attempts.attempt import failure_of
from worker.tasks.attempts.workplace import Workplace, workplace
from worker.tasks.previews.camera import KnownCameras
from worker.tasks.previews.picture import render_preview

IDLE_S = 600.0
"""The process ends when no order has come for this long: its memory is for others."""
TAKE_S = 1.0
"""The longest time of one wait for an order."""
RETRY_S = 1.0
"""The pause after the broker did not answer."""
ASK_S = 0.1
"""The interval at which the broker is asked whether a preview is still wanted."""
LET_FINISH_S = 1.0
"""A preview that is not wanted any more is rendered to its end within this time. To stop it would end the engine, whose
next start costs more."""

_PR_SET_PDEATHSIG = 1

log = structlog.get_logger()


class WantedMonitor:
    """A progress monitor that stops a preview which nobody waits for any more.

    Parameters
    ----------
    orders
        The connection to the broker.
    preview
        The id of the preview.
    place
        The workplace, which knows whether the worker is being shut down.
    limit_s
        The time after which it is stopped even if somebody waits: a preview may run an engine several times.
    """

    def __init__(self, orders: PreviewOrders, preview: str, place: Workplace, *, limit_s: float) -> None:
        self.progress = 0.0
        self._orders = orders
        self._preview = preview
        self._place = place
        self._limit_s = limit_s
        self._began_s = self._asked_s = time.monotonic()
        self._is_wanted = True

    def should_stop(self) -> bool:
        """Return whether the preview should end now."""
        now_s = time.monotonic()
        if now_s - self._asked_s >= ASK_S:
            self._asked_s = now_s
            with suppress(RedisError):
                self._is_wanted = self._orders.is_wanted(self._preview)
        took_s = now_s - self._began_s
        is_given_up = took_s > LET_FINISH_S and not self._is_wanted
        return is_given_up or took_s > self._limit_s or self._place.stopping()

    def announce_end(self) -> None:
        """Do nothing: a preview has no slot."""


class PreviewServer:
    """Renders the previews of one worker, one after the other.

    Parameters
    ----------
    place
        The workplace of the worker.
    orders
        The orders for it.
    """

    def __init__(self, place: Workplace, orders: PreviewOrders) -> None:
        self._place = place
        self._orders = orders
        self._cameras = KnownCameras()

    def serve(self, *, idle_s: float = IDLE_S) -> None:
        """Answer orders until none has come for a while."""
        last_s = time.monotonic()
        while time.monotonic() - last_s < idle_s and not self._place.stopping():
            try:
                order = self._orders.take(TAKE_S)
                if order is not None:
                    self._orders.answer(self.answer_to(order))
                    last_s = time.monotonic()
            except RedisError:  # the service answers without this worker, and the order is lost with its patience
                time.sleep(RETRY_S)

    def answer_to(self, order: PreviewOrder) -> PreviewAnswer:
        """Return the answer to an order: the pictures, or why there are none."""
        made, failure = self._made_or_failed(order)
        return PreviewAnswer(id=order.id, worker=order.worker, made=made, failure=failure)

    def _made_or_failed(self, order: PreviewOrder) -> tuple[PreviewMade | None, Failure | None]:
        own_s = self._place.settings.preview_limit_s
        limit = TimeLimit(order.timeout_s, "LIPPMANN_PREVIEW_TIMEOUT_S of the service").or_lower(
            own_s, "LIPPMANN_PREVIEW_LIMIT_S of the worker"
        )
        monitor = WantedMonitor(self._orders, order.id, self._place, limit_s=2 * limit.seconds)
        try:
            self._place.store.expect(order.store_id)
            made = render_preview(
                self._place, order.job, order.frame, limit=limit, cameras=self._cameras, monitor=monitor
            )
            return made, None
        except Exception as error:  # the outermost frame of a preview: every error is reported, and the process goes on
            is_unknown = not isinstance(error, LippmannError)
            failure = failure_of(error)
            log.warning("preview failed", code=failure.code, reason=failure.message[:500], exc_info=is_unknown)
            return None, failure


def main(parent: int) -> None:
    """Answer orders until the worker ends or no order comes."""
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it ended before the kernel was told
        return
    signal.signal(signal.SIGTERM, _end)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the worker, which ends this process
    settings = WorkerSettings()
    configure_logs(sys.stderr, log_format=settings.log_format, fields={"worker": settings.worker_name})
    limit_threads(1)
    orders = PreviewOrders(settings.broker, settings.worker_name, settings.instance, seals=settings.seals)
    PreviewServer(workplace(settings), orders).serve()


def _end(number: int, frame: FrameType | None) -> None:
    raise SystemExit


if __name__ == "__main__":
    main(int(sys.argv[1]))
