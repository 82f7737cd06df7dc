"""The threads of the coordinator.

They are leader election, event consumer, scheduler, fault monitor, loss monitor, reconciler, artifact repairer, job
remover, orphan sweeper, cache collector and webhook sender.

Each thread is a loop of short rounds. A round that fails is logged, and the next one follows. An unavailable broker or
a slow disk delays no request, since no request waits for the coordinator.
"""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import partial

import structlog
from sqlalchemy.exc import OperationalError, SQLAlchemyError

from lippmann.job.messages.events import Presence
from lippmann.job.messages.worker_keys import KEY_REFUSED, key_refusal
from lippmann.logs import trace_of
from lippmann.plan.artifact_store import ArtifactStore
from service.broker_stream import Entry, Stream, attempt_of
from service.claiming import ClaimWatches, is_able
from service.coordinator.artifact_repairer import ArtifactRepairer
from service.coordinator.background_jobs import ON_ARTIFACTS, ON_ROWS, BackgroundJobs
from service.coordinator.bundle_collector import BundleCollector
from service.coordinator.cache_collector import collect_cache, drop_cache
from service.coordinator.directions import DirectionsPublisher
from service.coordinator.event_consumer import consume_events
from service.coordinator.event_rules import WORKING
from service.coordinator.fault_monitor import FaultMonitor
from service.coordinator.leader_election import LeaderElection
from service.coordinator.liveness import Liveness
from service.coordinator.loss_monitor import LossMonitor
from service.coordinator.orphan_sweeper import sweep_orphans
from service.coordinator.reconciler import FarmView, Reconciler
from service.coordinator.retry_policy import INFRASTRUCTURE
from service.coordinator.scheduler import ROUND, OrderRate, dispatch
from service.db import coordinator as coordinator_rows
from service.db.engine import Database
from service.errors import BrokerUnavailable, DatabaseUnavailable, NotLeading
from service.events.wakeup import Wakeup
from service.health import package_version
from service.instruments import ORDERS
from service.jobs.storage_quota import resume_within_quota
from service.order_queue import OrderQueue
from service.settings import Settings
from service.store_check import StoreCheck
from service.store_identity import identify_store
from service.webhooks.sender import WebhookSender
from service.worker_keys.broker_users import BrokerUsers
from service.worker_keys.registry import WorkerKeys

BATCH = 200
"""The largest number of events in one transaction."""
GATHER_S = 0.02
"""The time in which events gather before they are written, and orders before they are sent. A transaction for each
single event would take most of a core when tasks take milliseconds."""
CLAIM_S = 0.2
"""The time for which events from which no order follows wait for others, so that they take no transaction of their own:
most tasks are claimed about then when another one ends."""
IDLE_ROUNDS = 50
"""The number of rounds without work after which the scheduler looks for work less often, every `IDLE_TICKS` ticks.
What happens in its own process wakes it at once; this is the time until it notices an action in another process."""
IDLE_TICKS = 5
ELECTION_S = 0.5
"""The interval at which a process looks whether it may lead."""
REFUSAL_S = 60.0
"""The time for which the broker keeps the signal that a key, or workers without one, are refused. It is short, since
the reason may go: the setting changes, or the clock of the leader was wrong. It is renewed while
such a worker is there."""
PRESENCE_S = 1.0
"""The time for which the list of workers is cached."""
LOSS_S = 1.0
"""The interval at which lost attempts and orders are searched for."""
JOIN_S = 5.0
CHECKPOINT_S = 300.0
FAULT_S = 1.0
"""The interval at which the fault monitor looks whether a check is due."""
SWEEP_S = 3600.0
COLLECT_S = 300.0
REPAIR_S = 1.0
REMOVE_S = 1.0
SET_BACK_S = 5.0
"""A clock that loses more than this between two rounds was set back."""
WEBHOOK_S = 1.0
SCHEDULER = "scheduler"

log = structlog.get_logger("service.coordinator")


def _may_lead_to_orders(entries: Iterable[Entry]) -> bool:
    return any(event is not None and event.kind not in WORKING for _, event in entries)


class Coordinator:
    """Keeps the jobs of a farm going, while this process is the leader."""

    def __init__(
        self, database: Database, store: ArtifactStore, settings: Settings, wakeup: Wakeup,
        *, worker_keys: WorkerKeys | None = None,
        clock: Callable[[], float] = time.time, steady: Callable[[], float] = time.monotonic,
    ) -> None:  # fmt: skip
        self.election = LeaderElection(database, ttl_s=settings.leader_ttl_s)
        # The sender needs no proof: it counts each attempt, and a message that was delivered is deleted by anybody.
        self._webhooks = WebhookSender(database, settings, is_active=self._is_active, clock=clock)
        identify = partial(identify_store, database, store)
        database = database.guarded(self.election.prove)
        self._database = database
        self._store = store
        self._settings = settings
        self._wakeup = wakeup
        self._clock = clock
        registry = worker_keys or WorkerKeys(database, needed=settings.workers_need_keys, clock=clock)
        self._stream = Stream(settings.broker, seals=registry.seals(settings), timeout_s=settings.broker_timeout_s)
        self._broker_users = BrokerUsers(settings.broker, timeout_s=settings.broker_timeout_s)
        self._queue = OrderQueue(
            settings.broker, seals=settings.seals, timeout_s=settings.broker_timeout_s, clock=clock
        )
        self._reconciler = Reconciler(database, store, settings)
        store_check = StoreCheck(
            store, reserve_bytes=settings.disk_reserve_bytes, identify=identify, make_room=partial(drop_cache, store)
        )  # fmt: skip
        self.fault_monitor = FaultMonitor(database, self._stream, store_check, settings)
        self._repairer = ArtifactRepairer(database, store, settings)
        self._bundles = BundleCollector(database, store)
        self._background_jobs = BackgroundJobs(database, store, settings, kinds=ON_ROWS)
        self._removals = BackgroundJobs(database, store, settings, kinds=ON_ARTIFACTS)
        self._workers: tuple[Presence, ...] = ()
        self._workers_s = float("-inf")
        self._steady = steady
        self._order_rate = OrderRate()
        self._idle_rounds = 0
        self._claim_watches = ClaimWatches(unmoved_s=settings.not_claiming_s)
        self._directions = DirectionsPublisher(database, self._stream, release=package_version(), steady=steady)
        self._not_claiming: Mapping[str, float] = {}
        self._first_orders: Mapping[str, str | None] = {}
        """The attempt of the order that is first in each queue, by the requirement of its jobs."""
        self._liveness = Liveness(silence_s=settings.lease_ttl_s, clock=clock, steady=steady)
        self._loss_monitor = LossMonitor(database, self._stream, self._reconciler, self._liveness, settings)
        self._checkpoint_s = steady()
        self._behind_s = steady() - clock()
        """The time by which the clock is behind the steady one; it grows when the clock is set back."""
        self._dropped: Counter[str] = Counter()
        self._stopping = threading.Event()
        self._threads: list[threading.Thread] = []

    def start(self) -> None:
        """Start the threads."""
        loops = {
            "leader-election": (self.election_round, min(ELECTION_S, self._settings.leader_ttl_s / 4)),
            "event-consumer": (self.consume_round, 0.0),
            SCHEDULER: (self.schedule_round, self._settings.tick_s),
            "fault-monitor": (self.fault_round, FAULT_S),
            "loss-monitor": (self.loss_round, LOSS_S),
            "reconciler": (self.reconcile_round, self._settings.reconcile_s),
            "orphan-sweeper": (self.sweep_round, SWEEP_S),
            "cache-collector": (self.collect_round, COLLECT_S),
            "artifact-repairer": (self.repair_round, REPAIR_S),
            "job-remover": (self.remove_round, REMOVE_S),
            "webhook-sender": (self.webhook_round, WEBHOOK_S),
        }
        for name, (run, pause_s) in loops.items():
            thread = threading.Thread(
                target=self._loop, args=(name, run, pause_s), name=f"coordinator-{name}", daemon=True
            )
            self._threads.append(thread)
            thread.start()

    def stop(self) -> None:
        """Stop the threads and allow another process to lead."""
        self._stopping.set()
        self._wakeup.notify()
        deadline_s = time.monotonic() + JOIN_S
        for thread in self._threads:
            thread.join(max(0.0, deadline_s - time.monotonic()))
        self._webhooks.join(timeout_s=max(0.0, deadline_s - time.monotonic()))
        # An unavailable database must not prevent the stop; another process leads once the deadline has passed.
        with suppress(SQLAlchemyError):
            self.election.step_down()
        self._stream.close()
        self._broker_users.close()
        self._queue.close()

    def election_round(self) -> None:
        """Become or remain the leader; a new leader first repairs the counters."""
        if not self.election.is_due:
            return
        was_leader = self.election.is_leader
        if not was_leader:
            self.fault_monitor.begin()
        if self.election.renew(now_s=self._clock()) and not was_leader:
            self._liveness.record_gap()
            self._loss_monitor.begin(now_s=self._clock())
            self._bundles.begin()
            recounted = self._reconciler.start()
            self._reconciler.end_long_pauses(now_s=self._clock())
            log.info("leads", process=self.election.name, jobs_recounted=recounted)
            self._wakeup.notify()

    def consume_round(self) -> None:
        """Write the events of workers to the database."""
        if not self.election.is_leader:
            self._stopping.wait(self._settings.tick_s)
            return
        try:
            count = self._consume_batch()
        except Exception:
            # Events could be neither read nor written, so no attempt is silent by its own fault.
            self._liveness.record_gap()
            raise
        self._liveness.record_round(caught_up=count < BATCH)
        if 0 < count < BATCH:
            self._stopping.wait(GATHER_S)

    def _consume_batch(self) -> int:
        with self._database.reading() as session:
            was = coordinator_rows.stream_position(session)
        entries = self._stream.read(was, count=BATCH, block_s=self._settings.tick_s)
        if entries and len(entries) < BATCH and not _may_lead_to_orders(entries):
            entries += self._stream.read(entries[-1][0], count=BATCH - len(entries), block_s=CLAIM_S)
        if entries:
            if any(event and event.failure and event.failure.code in INFRASTRUCTURE for _, event in entries):
                self.fault_monitor.poke()
            consume_events(self._database, entries, was=was, now_s=self._clock(), settings=self._settings)
            if _may_lead_to_orders(entries) or self._has_stops():
                self._wakeup.notify()
            else:
                self._wakeup.notify_coroutines()
        return len(entries)

    def schedule_round(self) -> None:
        """Run background jobs, signal stopped attempts, and dispatch tasks, until nothing more can be done."""
        if not self.election.is_leader:
            return
        more = True
        while more and not self._stopping.is_set() and self.election.is_leader:
            # Background jobs also run while the broker is unavailable; a plan then uses the last known slots.
            with suppress(BrokerUnavailable):
                self._present()
            more = self._background_jobs.run_round(
                slots=self._slots(), workers=len(self._claiming()), fleet=self._claiming(), now_s=self._clock()
            )
            self._signal_stops()
            sent = 0 if self.fault_monitor.faults else self._dispatch()
            self._idle_rounds = 0 if sent or more else self._idle_rounds + 1
            if sent or more:
                self._wakeup.notify_coroutines()
            more |= sent == ROUND

    def _dispatch(self) -> int:
        self._present()
        sent = dispatch(
            self._database,
            self._queue,
            self._claiming(),
            now_s=self._clock(),
            settings=self._settings,
            ahead=self._order_rate.ahead(at_s=self._steady()),
        )
        self._order_rate.record(sent, at_s=self._steady())
        ORDERS.inc(sent)
        return sent

    def fault_round(self) -> None:
        """Pause and resume jobs; faults are checked until they are gone, since without a database nobody leads."""
        if not (self.election.is_leader or self.fault_monitor.faults):
            return
        with suppress(BrokerUnavailable):
            self._present()
        had_faults = bool(self.fault_monitor.faults)
        self.fault_monitor.run(self._workers, now_s=self._clock())
        if self.fault_monitor.faults:
            return
        self._record_dropped()
        resumed = resume_within_quota(self._database, now_s=self._clock(), settings=self._settings)
        if had_faults or resumed:
            self._wakeup.notify()

    def reconcile_round(self) -> None:
        """Repair rows."""
        if not self.election.is_leader:
            return
        # The time is read before the liveness, so that a clock that is set between the two is noticed.
        now_s = self._clock()
        is_live = self._liveness.live_s() is not None
        view = FarmView(now_s=now_s, slots=self._slots(), is_live=is_live, workers=self._claiming())
        self._reconciler.run(view)
        self._heed_set_back()
        if self._steady() - self._checkpoint_s > CHECKPOINT_S:
            self._checkpoint_s = self._steady()
            self._database.checkpoint()
        with suppress(BrokerUnavailable):
            self._broker_users.reconcile(self._database, now_s=now_s)

    def _heed_set_back(self) -> None:
        """Shorten the pauses by as much as the clock was set back."""
        now_s = self._clock()
        was_s, self._behind_s = self._behind_s, self._steady() - now_s
        by_s = self._behind_s - was_s
        if by_s > SET_BACK_S:
            count = self._reconciler.shorten_pauses(by_s=by_s, now_s=now_s)
            log.warning("the clock was set back", by_s=round(by_s, 1), pauses_shortened=count)

    def loss_round(self) -> None:
        """Take back the tasks of lost attempts and lost orders."""
        if not self.election.is_leader:
            return
        try:
            count = self._loss_monitor.take_back_if_wiped(now_s=self._clock())
            count += self._loss_monitor.run(self._present(), self._first_orders, now_s=self._clock())
        except BrokerUnavailable:
            self._liveness.record_gap()
            raise
        if count:
            self._wakeup.notify()

    def repair_round(self) -> None:
        """Verify artifacts and take back the tasks that made damaged ones; this reads whole artifacts."""
        while self.election.is_leader and not self._stopping.is_set():
            if not self._repairer.run_round(now_s=self._clock()):
                return
            self._wakeup.notify()

    def remove_round(self) -> None:
        """Remove jobs with their artifacts; it has its own thread, since a bucket takes minutes for a large job."""
        while self.election.is_leader and not self._stopping.is_set():
            if not self._removals.run_round(now_s=self._clock()):
                return

    def sweep_round(self) -> None:
        """Delete the artifacts of removed jobs; it has its own thread, since a large store takes time."""
        if self.election.is_leader:
            sweep_orphans(self._database, self._store, now_s=self._clock())

    def collect_round(self) -> None:
        """Remove old entries of the render cache and those beyond its size, and scene bundles that nobody needs."""
        if self.election.is_leader:
            collect_cache(self._store, self._settings, now_s=self._clock())
            self._bundles.run(now_s=self._clock())

    def webhook_round(self) -> None:
        """Send the messages of webhooks that are due, in threads of their own."""
        if self._is_active():
            self._webhooks.run_round()

    def _is_active(self) -> bool:
        return self.election.is_leader and not self._stopping.is_set()

    def _slots(self) -> int:
        return sum(worker.slots for worker in self._claiming() if is_able(worker))

    def _claiming(self) -> tuple[Presence, ...]:
        """Return the workers that take orders, whose slots count."""
        return tuple(worker for worker in self._workers if worker.name not in self._not_claiming)

    def _present(self) -> tuple[Presence, ...]:
        if self._steady() - self._workers_s > PRESENCE_S:
            try:
                self._workers = self._stream.presences()
                self._signal_refused_keys()
                self._watch_claims()
            except BrokerUnavailable:
                self._claim_watches.reset()
                raise
            self._workers_s = self._steady()
        return self._workers

    def _signal_refused_keys(self) -> None:
        """Tell workers whose keys are refused that they are, so that they end."""
        refused = {one.worker_key for one in self._workers if one.fault is not None and one.fault.code == KEY_REFUSED}
        if refused:
            self._stream.stop(sorted(key_refusal(key_id) for key_id in refused), ttl_s=REFUSAL_S)

    def _watch_claims(self) -> None:
        if self.election.is_leader:
            self._directions.run(self._workers, now_s=self._clock())
        first = self._stream.first_orders(self._directions.requirements)
        self._first_orders = {text: attempt_of(message) for text, message in first.items()}
        was = self._not_claiming
        self._not_claiming = self._claim_watches.observe(self._workers, first, now_s=self._clock())
        if was or self._not_claiming:
            self._stream.publish_not_claiming(self._not_claiming)
        if was.keys() != self._not_claiming.keys():
            log.warning("workers that take no orders have changed", not_claiming=sorted(self._not_claiming))

    def _record_dropped(self) -> None:
        dropped = Counter(self._stream.dropped)
        if dropped != self._dropped:
            with self._database.writing() as session:
                coordinator_rows.add_dropped(session, dropped - self._dropped)
            self._dropped = dropped

    def _has_stops(self) -> bool:
        with self._database.reading() as session:
            return bool(coordinator_rows.pending_stops(session, limit=1))

    def _signal_stops(self) -> None:
        with self._database.reading() as session:
            attempts = coordinator_rows.pending_stops(session)
        if attempts:
            self._stream.stop(attempts, ttl_s=self._settings.stop_ttl_s)
            with self._database.writing() as session:
                coordinator_rows.delete_stops(session, attempts)

    def _loop(self, name: str, run: Callable[[], None], pause_s: float) -> None:
        is_logged = False
        with self._wakeup.for_thread() as woken:
            while not self._stopping.is_set():
                begun_s = time.monotonic()
                if name == SCHEDULER:
                    woken.clear()
                try:
                    run()
                    is_logged = False
                except NotLeading:
                    log.info("another process leads", loop=name)
                except Exception as error:  # the outermost frame of the thread: the next round follows in any case
                    # What is unavailable for an hour, or full, is logged once and not 18,000 times.
                    is_outage = isinstance(error, BrokerUnavailable | DatabaseUnavailable | OperationalError)
                    if not (is_logged and is_outage):
                        trace = "" if is_outage else trace_of(error)
                        log.warning("a round failed", loop=name, error=repr(error), trace=trace)
                    is_logged = is_outage
                    if isinstance(error, OperationalError):
                        self.fault_monitor.poke()
                    self._stopping.wait(self._settings.tick_s)
                if name == SCHEDULER:
                    self._stopping.wait(GATHER_S)
                    pause_s = self._settings.tick_s * (1 if self._idle_rounds < IDLE_ROUNDS else IDLE_TICKS)
                left_s = pause_s - (time.monotonic() - begun_s)
                if left_s > 0:
                    (woken if name == SCHEDULER else self._stopping).wait(left_s)
