"""The threads that keep jobs going while this process leads: lead, follow, dispatch, reconcile, sweep.

Each is a loop of short rounds. A round that fails is said and the next one comes; a dead broker or a slow disk stops
no request, since no request waits for the clerk.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from traceback import format_exception

import structlog
from sqlalchemy.exc import SQLAlchemyError

from lippmann.job.events import Presence
from service.broker_stream import Stream
from service.coordinator.background_jobs import Chores
from service.coordinator.event_consumer import follow
from service.coordinator.leader_election import Leadership
from service.coordinator.liveness import Hearing
from service.coordinator.orphan_sweeper import sweep_orphans
from service.coordinator.reconciler import Reconciler, Sight
from service.coordinator.scheduler import ROUND, dispatch
from service.db import coordinator as clerk_rows
from service.db.engine import Database
from service.errors import BrokerUnavailable
from service.events.wakeup import Bell
from service.order_queue import OrderQueue
from service.ports import ArtifactStore
from service.settings import Settings

FOLLOW_COUNT = 200
"""Events that one transaction writes down."""
PRESENCE_S = 1.0
"""How long it is believed who is there."""
JOIN_S = 5.0
TIDY_S = 300.0
SWEEP_S = 3600.0

log = structlog.get_logger("service.clerk")


class Clerk:
    """Keeps the jobs of a farm going."""

    def __init__(
        self, database: Database, store: ArtifactStore, settings: Settings, bell: Bell,
        *, clock: Callable[[], float] = time.time, steady: Callable[[], float] = time.monotonic,
    ) -> None:  # fmt: skip
        self.leadership = Leadership(database, ttl_s=settings.leader_ttl_s)
        self._database = database
        self._store = store
        self._settings = settings
        self._bell = bell
        self._clock = clock
        self._stream = Stream(settings.redis_url, timeout_s=settings.broker_timeout_s)
        self._queue = OrderQueue(settings.redis_url, timeout_s=settings.broker_timeout_s)
        self._reconciler = Reconciler(database, store, settings)
        self._chores = Chores(database, store, settings)
        self._workers: tuple[Presence, ...] = ()
        self._workers_s = float("-inf")
        self._hearing = Hearing(gap_s=settings.lease_ttl_s / 3, clock=clock, steady=steady)
        self._tidied_s = clock()
        self._stopping = threading.Event()
        self._threads: list[threading.Thread] = []

    def start(self) -> None:
        """Start the threads."""
        loops = {
            "lead": (self.lead_round, self._settings.leader_ttl_s / 4),
            "follow": (self.follow_round, 0.0),
            "dispatch": (self.dispatch_round, self._settings.tick_s),
            "reconcile": (self.reconcile_round, self._settings.reconcile_s),
            "sweep": (self.sweep_round, SWEEP_S),
        }
        for name, (run, pause_s) in loops.items():
            thread = threading.Thread(target=self._loop, args=(name, run, pause_s), name=f"clerk-{name}", daemon=True)
            self._threads.append(thread)
            thread.start()

    def stop(self) -> None:
        """Stop the threads and let another clerk lead."""
        self._stopping.set()
        self._bell.ring()
        deadline_s = time.monotonic() + JOIN_S
        for thread in self._threads:
            thread.join(max(0.0, deadline_s - time.monotonic()))
        # A database that is away keeps nobody from stopping; another clerk leads when the time of this one is over.
        with suppress(SQLAlchemyError):
            self.leadership.step_down()
        self._stream.close()
        self._queue.close()

    def lead_round(self) -> None:
        """Become or stay the leader; a new leader first makes the rows right."""
        led = self.leadership.is_held
        if self.leadership.renew(now_s=self._clock()) and not led:
            self._hearing.miss()
            wrong = self._reconciler.start()
            log.info("leads", clerk=self.leadership.name, rows_recounted=wrong)
            self._bell.ring()

    def follow_round(self) -> None:
        """Write down what the stream says."""
        if not self.leadership.is_held:
            self._stopping.wait(self._settings.tick_s)
            return
        try:
            heard = self._follow_some()
        except Exception:
            # Whatever kept the clerk from hearing or from writing down, no attempt is silent because of it.
            self._hearing.miss()
            raise
        self._hearing.hear(all_of_it=heard < FOLLOW_COUNT)

    def _follow_some(self) -> int:
        with self._database.reading() as session:
            was = clerk_rows.clerk(session).position
        entries = self._stream.read(was, count=FOLLOW_COUNT, block_s=self._settings.tick_s)
        if entries:
            follow(self._database, entries, was=was, now_s=self._clock(), settings=self._settings)
            self._bell.ring()
        return len(entries)

    def dispatch_round(self) -> None:
        """Send out what there is room for, tell attempts to stop, and do chores while there are any."""
        if not self.leadership.is_held:
            return
        more = True
        while more and not self._stopping.is_set() and self.leadership.is_held:
            # Chores are done while the broker is away too; a plan counts the slots that were there last.
            with suppress(BrokerUnavailable):
                self._present()
            more = self._chores.do_some(slots=self._slots(), now_s=self._clock())
            self._tell_stopped()
            sent = dispatch(self._database, self._queue, self._present(), now_s=self._clock(), settings=self._settings)
            if sent or more:
                self._bell.ring()
            more |= sent == ROUND

    def reconcile_round(self) -> None:
        """Make the rows right."""
        if not self.leadership.is_held:
            return
        try:
            if self._stream.is_new():
                sent_back = self._reconciler.broker_is_new(now_s=self._clock())
                log.info("the broker is new", orders_sent_back=sent_back)
        except BrokerUnavailable:
            self._hearing.miss()
        # The time before the hearing: a clock that is set between the two is noticed.
        now_s = self._clock()
        self._reconciler.run(Sight(now_s=now_s, slots=self._slots(), listening_since_s=self._hearing.since_s()))
        if self._clock() - self._tidied_s > TIDY_S:
            self._tidied_s = self._clock()
            self._database.tidy()

    def sweep_round(self) -> None:
        """Take away what removed jobs left; on a thread of its own, since a large store takes its time."""
        if self.leadership.is_held:
            sweep_orphans(self._database, self._store, now_s=self._clock())

    def _slots(self) -> int:
        return sum(worker.slots for worker in self._workers)

    def _present(self) -> tuple[Presence, ...]:
        if self._clock() - self._workers_s > PRESENCE_S:
            self._workers = self._stream.presences()
            self._workers_s = self._clock()
        return self._workers

    def _tell_stopped(self) -> None:
        with self._database.reading() as session:
            attempts = clerk_rows.to_stop(session)
        if attempts:
            self._stream.stop(attempts, ttl_s=self._settings.stop_ttl_s)
            with self._database.writing() as session:
                clerk_rows.stopped(session, attempts)

    def _loop(self, name: str, run: Callable[[], None], pause_s: float) -> None:
        silent = False
        with self._bell.in_thread() as woken:
            while not self._stopping.is_set():
                begun_s = time.monotonic()
                if name == "dispatch":
                    woken.clear()
                try:
                    run()
                    silent = False
                except Exception as error:  # the outermost frame of the thread: the next round comes whatever happened
                    # A broker that is down for an hour is said once, not 18,000 times.
                    if not (silent and isinstance(error, BrokerUnavailable)):
                        trace = "" if isinstance(error, BrokerUnavailable) else "".join(format_exception(error))
                        log.warning("a round failed", loop=name, error=repr(error), trace=trace)
                    silent = isinstance(error, BrokerUnavailable)
                    self._stopping.wait(self._settings.tick_s)
                left_s = pause_s - (time.monotonic() - begun_s)
                if left_s > 0:
                    (woken if name == "dispatch" else self._stopping).wait(left_s)
