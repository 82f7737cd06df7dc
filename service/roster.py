"""The workers that are online, as every process of the service knows them from the broker."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from lippmann.job.messages.events import Presence
from service.broker_stream import Stream
from service.claiming import fitting, is_able, takes_orders
from service.errors import BrokerUnavailable

FRESH_S = 1.0
"""The age up to which a known roster is returned without a question to the broker."""
AWAY_S = 5.0
"""The time for which a broker that did not answer is not asked again."""


@dataclass(frozen=True)
class Roster:
    """The workers that are online, and since when some of them have taken no orders, by name."""

    present: tuple[Presence, ...]
    not_claiming: Mapping[str, float]

    @property
    def claiming(self) -> tuple[Presence, ...]:
        """The workers that take orders."""
        return tuple(worker for worker in self.present if worker.name not in self.not_claiming and takes_orders(worker))

    @property
    def able(self) -> tuple[Presence, ...]:
        """The workers that take orders and can do them."""
        return tuple(filter(is_able, self.claiming))

    def fitting(self, requirement: str) -> Roster:
        """Return the workers that meet the requirement of a job."""
        return Roster(fitting(self.present, requirement), self.not_claiming)

    @property
    def slots(self) -> int:
        """The slots of the workers that take orders."""
        return sum(worker.slots for worker in self.claiming)


def read_roster(stream: Stream) -> Roster:
    """Return the workers that are online now.

    Raises
    ------
    BrokerUnavailable
        If the broker does not answer.
    """
    return Roster(stream.presences(), stream.not_claiming())


class RosterCache:
    """The latest roster for requests, which must not wait for a broker that is slow or away.

    One request asks the broker when the roster is old, and the others go on with what is known.
    """

    def __init__(self, stream: Stream, *, steady: Callable[[], float] = time.monotonic) -> None:
        self._stream = stream
        self._steady = steady
        self._asking = threading.Lock()
        self._roster: Roster | None = None
        self._until_s = float("-inf")

    def latest(self) -> Roster | None:
        """Return the workers that are online; None if the broker does not answer."""
        if self._steady() >= self._until_s and self._asking.acquire(blocking=False):
            try:
                self._ask()
            finally:
                self._asking.release()
        return self._roster

    def _ask(self) -> None:
        try:
            self._roster = read_roster(self._stream)
            self._until_s = self._steady() + FRESH_S
        except BrokerUnavailable:
            self._roster = None
            self._until_s = self._steady() + AWAY_S
