"""The duty of a worker: whether it takes orders now, and from which queues.

A worker takes no orders while it is drained, outside its hours, and while the service has a version of the messages
that it does not understand. It then polls no queue, finishes what it has begun, and its presence gives the reason.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime

import structlog
from pydantic import ValidationError

from lippmann.job.messages import wire
from lippmann.job.messages.events import Closed, Directions, Presence
from lippmann.job.messages.protocol import PROTOCOL
from lippmann.job.rendering.workers import JobRequirement
from worker.hours import Hours

log = structlog.get_logger()

SETTLED_TICKS = 4
"""The number of ticks without an attempt after which a drained worker may end. A poll that had begun before the drain
is answered within a second, perhaps with an order."""


@dataclass
class _Drain:
    ends: bool
    until_s: float | None
    """The time of the steady clock at which the attempts that still run are ended; None for no such time."""


class Duty:
    """The rule whether a worker takes orders now, and why not.

    Parameters
    ----------
    profile
        The presence of the worker: its pool, tags, memory and versions.
    hours
        The hours in which it takes orders; None if it always does.
    clock
        The wall clock, in seconds since 1970.
    steady
        A clock that is never set, in seconds.
    """

    def __init__(
        self,
        profile: Presence,
        hours: Hours | None = None,
        *,
        clock: Callable[[], float] = time.time,
        steady: Callable[[], float] = time.monotonic,
    ) -> None:
        self._profile = profile
        self._hours = hours
        self._clock = clock
        self._steady = steady
        self._directions: Directions | None = None
        self._own_drain: _Drain | None = None
        self._settled_ticks = 0
        self._told: Closed | None = None
        self.closed: Closed | None = None
        """The reason why the worker takes no orders; None if it takes some."""
        self.opens_s: float | None = None
        """The time at which its hours begin again, in seconds since 1970; None if something else closes it."""
        self.refresh()

    @property
    def queues(self) -> frozenset[str]:
        """The queues from which it takes orders: its first one, and those of the requirements that it meets."""
        named = self._directions.requirements if self._directions is not None else ()
        fitting = {wire.queue_of(text) for text in named if self._fits(text)}
        return frozenset({first_queue(self._profile.pool, has_povray=self._profile.has_povray), *fitting})

    def follow(self, directions: Directions) -> None:
        """Follow the directions of the service from now on."""
        before, self._directions = self._directions, directions
        if before is None or (before.release, before.protocol) != (directions.release, directions.protocol):
            self._log_version(directions)
        self.refresh()

    def drain(self, *, ends: bool, within_s: float | None = None) -> None:
        """Take no further orders; the handler of a signal may call this, so the next `refresh` logs it.

        A handler interrupts its own thread, which may hold the lock of the log.

        Parameters
        ----------
        ends
            True if the worker ends when it has finished its attempts.
        within_s
            The time after which it ends in any case, with those that still run; None for no such time.
        """
        self._own_drain = _Drain(ends, None if within_s is None else self._steady() + within_s)
        self.closed = Closed.DRAINING

    def refresh(self) -> None:
        """Find out again whether the worker takes orders."""
        self.closed = self._reason()
        if self.closed is self._told:
            return
        self._told = self.closed
        self.opens_s = None
        if self.closed is Closed.HOURS and self._hours is not None:
            self.opens_s = self._hours.next_begin_s(self._clock())
        log.info("takes orders" if self.closed is None else "takes no orders", reason=self.closed)

    def may_end(self, *, held: int) -> bool:
        """Return in every tick whether a drained worker that shall end has finished, or has no more time to finish.

        Parameters
        ----------
        held
            The number of attempts that the worker holds.
        """
        self._settled_ticks = self._settled_ticks + 1 if self.closed is Closed.DRAINING and not held else 0
        drain = self._drain
        if drain is None or not drain.ends:
            return False
        is_over = drain.until_s is not None and self._steady() >= drain.until_s
        return is_over or self._settled_ticks >= SETTLED_TICKS

    @property
    def _drain(self) -> _Drain | None:
        """The drain by a signal, or else the one that the service asks for."""
        if self._own_drain is not None:
            return self._own_drain
        ends = self._directions.drains.get(self._profile.instance or "") if self._directions is not None else None
        return None if ends is None else _Drain(ends, None)

    def _reason(self) -> Closed | None:
        if self._drain is not None:
            return Closed.DRAINING
        if not self._is_understood:
            return Closed.VERSION
        if self._hours is not None and not self._hours.include(datetime.fromtimestamp(self._clock())):
            return Closed.HOURS
        return None

    @property
    def _is_understood(self) -> bool:
        found = self._directions
        return found is None or self._profile.understands(found.protocol, found.oldest_protocol)

    def _fits(self, requirement: str) -> bool:
        try:
            return not self._profile.lacks(JobRequirement.of(requirement))
        except ValidationError:  # of a later release, which asks for something that this one does not know
            return False

    def _log_version(self, directions: Directions) -> None:
        own = self._profile.version
        if not self._is_understood:
            log.error(
                f"this worker runs Lippmann {own} (messages {PROTOCOL}), the service {directions.release} (messages "
                f"{directions.protocol}): it takes no orders until both have versions that understand each other"
            )
        elif directions.release != own:
            log.warning(f"this worker runs Lippmann {own}, the service {directions.release}: upgrade the older one")


def first_queue(pool: str, *, has_povray: bool) -> str:
    """Return the queue of a pool from which a worker always takes orders; an empty name stands for no pool.

    It is that of the jobs that ask for the pool and for nothing else, which need POV-Ray, or else that of the jobs that
    need no engine.
    """
    return wire.queue_of(JobRequirement(pool=pool, engine="povray" if has_povray else "none").text)
