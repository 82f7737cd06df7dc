"""Delivers the messages of the outbox: at least once, with pauses that grow, and a number of attempts that is bounded.

An attempt is counted before it begins, so a process that is killed in the middle of one neither loses the message nor
repeats it without end. One slow receiver delays the messages of its own owner only.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import structlog

from lippmann.errors import BadInput
from lippmann.logs import trace_of
from service.db import jobs as job_rows
from service.db import webhooks as rows
from service.db.engine import Database
from service.db.tables import WebhookDelivery
from service.events.publish import publish_jobs
from service.instruments import Delivery, count_delivery
from service.settings import Settings
from service.webhooks.post import NoAnswer, post
from service.webhooks.receiver import ReceiverRefused, parse_receiver, resolve, rules_of
from service.webhooks.signature import signed_headers

MAX_THREADS = 8
"""The number of owners whose messages are sent at the same time."""
LONGEST_PAUSE_S = 6 * 3600.0
GROWTH = 4.0
"""The factor from one pause to the next."""
GONE = 410

log = structlog.get_logger("service.webhooks")


class GivenUp(Exception):
    """The receiver shall not get this message."""


class WebhookSender:
    """Sends the messages that are due, in threads of its own."""

    def __init__(
        self, database: Database, settings: Settings, *, is_active: Callable[[], bool],
        clock: Callable[[], float] = time.time,
    ) -> None:  # fmt: skip
        self._database = database
        self._settings = settings
        self._keys = settings.link_keys
        self._rules = rules_of(settings)
        self._is_active = is_active
        self._clock = clock
        self._lock = threading.Lock()
        self._serving: dict[str, threading.Thread] = {}

    def run_round(self) -> None:
        """Start to send for the owners with due messages, and return at once."""
        with self._database.reading() as session:
            owners = rows.owners_with_due(session, now_s=self._clock(), limit=2 * MAX_THREADS)
        for owner_id in owners:
            with self._lock:
                if owner_id in self._serving or len(self._serving) >= MAX_THREADS:
                    continue
                thread = threading.Thread(target=self._serve, args=(owner_id,), name="webhook", daemon=True)
                # A thread that cannot be started must not count as one that serves; the new one waits for the lock.
                thread.start()
                self._serving[owner_id] = thread

    def join(self, *, timeout_s: float) -> None:
        """Wait for the attempts that are being made, once the sender is no longer active."""
        until_s = time.monotonic() + timeout_s
        with self._lock:
            threads = list(self._serving.values())
        for thread in threads:
            thread.join(max(0.0, until_s - time.monotonic()))

    def _serve(self, owner_id: str) -> None:
        try:
            while self._is_active() and self.send_next(owner_id):
                pass
        except Exception as error:  # the outermost frame of the thread: the next round starts another one
            log.warning("webhooks could not be sent", error=repr(error), trace=trace_of(error))
        finally:
            with self._lock:
                del self._serving[owner_id]

    def send_next(self, owner_id: str) -> bool:
        """Make one attempt to deliver the message of an owner that is due first; return False if none is due."""
        most = self._settings.webhook_attempts
        with self._database.writing() as session:
            now_s = self._clock()
            delivery = rows.first_due(session, owner_id, now_s=now_s)
            if delivery is None:
                return False
            number = delivery.attempts + 1
            if number <= most and not rows.begin_attempt(session, delivery, next_s=now_s + self._pause_s(number)):
                return True
        try:
            if number > most:  # A process was killed during the last attempt, or fewer are allowed now.
                raise GivenUp("the last attempt did not end")
            self._attempt(delivery)
        except (GivenUp, ReceiverRefused) as error:
            self._end(delivery, f"the webhook was not delivered: {error}")
        except (NoAnswer, OSError, BadInput) as error:
            self._fail(delivery, number, error)
        else:
            self._end(delivery, None)
        return True

    def _attempt(self, delivery: WebhookDelivery) -> None:
        receiver = parse_receiver(delivery.url, self._rules)
        try:
            addresses = resolve(receiver, self._rules)
        except (OSError, UnicodeError) as error:
            raise NoAnswer(f"the host {receiver.host} has no address") from error
        body = delivery.body.encode()
        keys = self._keys.keys()
        if not keys:
            raise NoAnswer("the farm has no key to sign it with")
        headers = signed_headers(keys, delivery.owner_id, delivery.id, body, now_s=self._clock())
        status = post(receiver, addresses, headers, body, timeout_s=self._settings.webhook_timeout_s)
        if status == GONE:
            raise GivenUp("the receiver answered 410")
        if not 200 <= status < 300:
            raise NoAnswer(f"the receiver answered {status}")

    def _fail(self, delivery: WebhookDelivery, number: int, error: Exception) -> None:
        most = self._settings.webhook_attempts
        reason = str(error) if isinstance(error, NoAnswer) else type(error).__name__
        if number >= most:
            self._end(delivery, f"the webhook was not delivered in {most} attempts: {reason}")
            return
        message = f"attempt {number} of {most} to deliver the webhook: {reason}"
        count_delivery(Delivery.FAILED)
        log.info("a webhook was not delivered", job=delivery.job_id, message=delivery.id, error=message)
        self._show(delivery, message)

    def _end(self, delivery: WebhookDelivery, error: str | None) -> None:
        """Delete a message that was delivered or is given up."""
        count_delivery(Delivery.DELIVERED if error is None else Delivery.GIVEN_UP)
        if error is not None:
            log.warning("a webhook is given up", job=delivery.job_id, message=delivery.id, error=error)
        self._show(delivery, error, is_last=True)

    def _show(self, delivery: WebhookDelivery, error: str | None, *, is_last: bool = False) -> None:
        with self._database.writing() as session:
            if is_last:
                rows.remove(session, delivery.id)
            if rows.set_error(session, delivery.job_id, error, url=delivery.url):
                row = job_rows.job(session, delivery.job_id)
                if row is not None:
                    publish_jobs(session, [row])

    def _pause_s(self, number: int) -> float:
        return float(min(LONGEST_PAUSE_S, self._settings.webhook_pause_s * GROWTH ** (number - 1)))
