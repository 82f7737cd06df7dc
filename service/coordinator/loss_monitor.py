"""The loss monitor takes tasks back from lost attempts, and orders that no longer exist.

The rule is `service.coordinator.loss_detector`. It needs one scan of the presences, and one query of the leases of the
attempts for which no presence vouches, which are few.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import structlog

from lippmann.job.messages.events import Presence
from lippmann.job.states import TaskStatus
from service.broker_stream import Stream
from service.coordinator.liveness import Liveness
from service.coordinator.loss_detector import LossDetector, Sighting, without_voucher
from service.coordinator.reconciler import Reconciler
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.engine import Database
from service.ids import task_id
from service.settings import Settings

log = structlog.get_logger("service.loss_monitor")


class LossMonitor:
    """Finds lost attempts and lost orders."""

    def __init__(
        self, database: Database, stream: Stream, reconciler: Reconciler, liveness: Liveness, settings: Settings
    ) -> None:
        self._database = database
        self._stream = stream
        self._reconciler = reconciler
        self._liveness = liveness
        self._settings = settings
        self.begin(now_s=0.0)

    def begin(self, *, now_s: float) -> None:
        """Forget what an earlier leader saw."""
        self._detector = LossDetector(silence_s=self._settings.lease_ttl_s)
        self._known_s = now_s

    def take_back_if_wiped(self, *, now_s: float) -> int:
        """Take back the orders that a broker lost which was wiped, and return their number.

        Raises
        ------
        BrokerUnavailable
            If the broker does not answer.
        """
        count = 0
        if self._stream.is_new():
            count = self._reconciler.take_back_all(sent_until_s=self._known_s, now_s=now_s)
            self._stream.mark()  # after the work, which follows again if it failed or this process was killed
            log.info("the broker is new", orders_taken_back=count)
        # An order that is sent from now on is in the broker that was examined, or in a later one.
        self._known_s = now_s
        return count

    def run(self, workers: Sequence[Presence], first_orders: Mapping[str, str | None], *, now_s: float) -> int:
        """Take back the tasks of what is lost now, and return their number.

        Parameters
        ----------
        first_orders
            The attempt of the order that is first in each queue, by the requirement of its jobs.

        Raises
        ------
        BrokerUnavailable
            If the broker does not answer.
        """
        with self._database.reading() as session:
            held = task_rows.held(session, job_rows.busy_ids(session))
            requirements = job_rows.requirements_of_busy(session)
        by_name = {worker.name: worker for worker in workers}
        leases = self._stream.leases(without_voucher(held, by_name))
        # Read last: the events of before the queries are then read in the rounds that follow.
        live_s, rounds = self._liveness.live_s(), self._liveness.rounds
        if live_s is None:
            return 0
        seen = Sighting(
            live_s=live_s, rounds=rounds, workers=by_name, leases=leases, first_orders=first_orders,
            requirements=requirements,
        )  # fmt: skip
        reasons = self._detector.observe(held, seen)
        lost = [each for each in held if each.attempt in reasons]
        for each in lost:
            log.warning(
                "lost", job=each.job_id, task=task_id(each.job_id, each.sequence), attempt=each.attempt,
                worker=each.worker, why=reasons[each.attempt],
            )  # fmt: skip
        self._reconciler.take_back((each for each in lost if each.status is TaskStatus.DISPATCHED), now_s=now_s)
        self._reconciler.give_up(
            [(each, reasons[each.attempt]) for each in lost if each.status is TaskStatus.RUNNING], now_s=now_s
        )
        return len(lost)
