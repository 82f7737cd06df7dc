"""The row of the coordinator and the stop requests."""

from __future__ import annotations

from lippmann.job.states import TaskStatus
from service.coordinator.reconciler import Reconciler
from service.db import coordinator as coordinator_rows
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from tests.builders_service import Farm, claimed, heartbeat


def test_a_lost_attempt_that_goes_on_reporting_is_requested_to_stop_without_an_error(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    with farm.database.reading() as session:
        held = task_rows.held(session, job_rows.busy_ids(session))
    lost = [(each, "gone") for each in held if each.attempt == order.attempt]
    Reconciler(farm.database, farm.store, farm.settings).give_up(lost, now_s=farm.now_s)
    assert farm.task(order).status is TaskStatus.READY
    farm.now_s += 1
    assert farm.say(claimed(order), heartbeat(order), heartbeat(order))
    with farm.writing() as session:
        coordinator_rows.request_stop(session, [order.attempt, None, order.attempt], now_s=farm.now_s)
        coordinator_rows.request_stop(session, [order.attempt], now_s=farm.now_s)
    with farm.database.reading() as session:
        assert list(coordinator_rows.pending_stops(session)) == [order.attempt]
    again = next(other for other in farm.dispatch() if other.task_id == order.task_id)
    assert again.attempt != order.attempt
