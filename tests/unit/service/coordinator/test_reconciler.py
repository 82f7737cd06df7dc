"""The rows are made right without any event, by a clock that the test moves."""

from __future__ import annotations

import pytest
from sqlalchemy import update

from lippmann.errors import StoreUnavailable
from lippmann.job.messages.orders import Order
from lippmann.job.states import JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from service.coordinator.loss_detector import LossDetector, Sighting
from service.coordinator.reconciler import FarmView, Reconciler
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.coordinator import current, pending_stops
from service.db.tables import Job, Task
from tests.builders_service import Farm, claimed, done, failed, heartbeat, presence


class Watch:
    """A reconciler, and time that passes in its own steps."""

    def __init__(self, farm: Farm) -> None:
        self.farm = farm
        self.is_live = True
        self.live_s = 0.0
        self.slots = 2
        self.detector = LossDetector(silence_s=farm.settings.lease_ttl_s)
        self.reconciler = Reconciler(farm.database, farm.store, farm.settings)
        self.look()

    def look(self) -> None:
        self.reconciler.run(FarmView(now_s=self.farm.now_s, slots=self.slots, is_live=self.is_live))
        if self.is_live:
            with self.farm.database.reading() as session:
                held = task_rows.held(session, job_rows.busy_ids(session))
            seen = Sighting(live_s=self.live_s, rounds=0, workers={}, leases={}, first_orders={"": ""})
            reasons = self.detector.observe(held, seen)
            lost = [(each, reasons[each.attempt]) for each in held if each.attempt in reasons]
            self.reconciler.give_up(lost, now_s=self.farm.now_s)

    def wait(self, seconds: float) -> None:
        self.look()
        for _ in range(round(seconds / self.farm.settings.reconcile_s)):
            self.farm.now_s += self.farm.settings.reconcile_s
            self.live_s += self.farm.settings.reconcile_s if self.is_live else 0.0
            self.look()


@pytest.fixture
def watch(farm: Farm) -> Watch:
    return Watch(farm)


def _store(farm: Farm, order: Order) -> None:
    farm.store.files[names.job_artifact(order.job_id, farm.task(order).artifact)] = b"whole"


def _stops(farm: Farm) -> set[str]:
    with farm.database.reading() as session:
        return set(pending_stops(session))


def test_a_silent_attempt_is_lost_and_its_task_goes_back(farm: Farm, watch: Watch) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order, "w1"))
    watch.wait(farm.settings.lease_ttl_s)
    assert farm.task(order).status is TaskStatus.RUNNING
    watch.wait(5)
    task = farm.task(order)
    assert (task.status, task.failures, task.losses) == (TaskStatus.READY, 0, 1)
    assert (task.failed_on, task.error_code) == (["w1"], "lost")
    assert order.attempt in _stops(farm)


def test_an_attempt_that_beats_is_never_lost(farm: Farm, watch: Watch) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    for _ in range(10):
        watch.wait(30)
        farm.say(heartbeat(order))
    assert farm.task(order).status is TaskStatus.RUNNING


def test_a_task_that_kills_every_worker_has_failed_at_its_limit_with_the_reason(farm: Farm, watch: Watch) -> None:
    farm.planned(frames="1-30", outputs=[])
    order, *_ = farm.dispatch()
    for losses in range(1, 11):
        farm.say(claimed(order, f"w{losses}"))
        watch.wait(50)
        task = farm.task(order)
        assert (task.losses, task.failures) == (losses, 0)
        if losses < 10:
            assert task.not_before_s == farm.now_s + farm.settings.retry_pause_s * (losses - 1)
            farm.now_s += 20
            order = next(other for other in farm.dispatch() if other.task_id == order.task_id)
    assert (task.status, task.error_code) == (TaskStatus.FAILED, "lost")
    reason = "worker w10 went silent; 10 attempts were lost with their workers, so the task is not tried again"
    assert task.error_message == reason


def test_a_lost_attempt_whose_artifact_is_there_was_done(farm: Farm, watch: Watch) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    _store(farm, order)
    watch.wait(50)
    assert (farm.task(order).status, farm.job(job_id).done_px) == (TaskStatus.DONE, farm.task(order).weight_px)


def test_one_folder_that_cannot_be_read_keeps_no_other_row_from_being_made_right(
    farm: Farm, watch: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    farm.planned()
    first, second, *_ = farm.dispatch()
    farm.say(claimed(first), claimed(second))
    unreadable = names.job_artifact(first.job_id, farm.task(first).artifact)

    def exists(name: str) -> bool:
        if name == unreadable:
            raise StoreUnavailable
        return False

    monkeypatch.setattr(farm.store, "exists", exists)
    watch.wait(50)
    assert (farm.task(first).status, farm.task(second).status) == (TaskStatus.RUNNING, TaskStatus.READY)
    monkeypatch.undo()
    watch.wait(5)
    assert farm.task(first).status is TaskStatus.READY


def test_a_clock_that_was_set_back_hides_no_silent_attempt(farm: Farm, watch: Watch) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    farm.now_s -= 3600
    watch.wait(40)
    assert farm.task(order).status is TaskStatus.RUNNING
    watch.wait(10)
    assert farm.task(order).status is TaskStatus.READY


def test_nobody_is_lost_while_nobody_listened(farm: Farm, watch: Watch) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    watch.is_live = False  # the broker is down
    watch.wait(300)
    assert farm.task(order).status is TaskStatus.RUNNING
    watch.is_live = True
    watch.wait(40)
    assert farm.task(order).status is TaskStatus.RUNNING
    watch.wait(10)
    assert farm.task(order).status is TaskStatus.READY


def test_an_unclaimed_order_goes_back_after_its_time_and_its_attempt_is_told_to_stop(farm: Farm, watch: Watch) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    watch.wait(farm.settings.unclaimed_s)
    assert farm.task(order).status is TaskStatus.DISPATCHED
    watch.wait(5)
    task = farm.task(order)
    assert (task.status, task.failures, order.attempt in _stops(farm)) == (TaskStatus.READY, 0, True)


def test_the_time_of_an_unclaimed_order_stands_still_while_every_slot_is_busy(farm: Farm, watch: Watch) -> None:
    farm.planned()
    first, second, third, *_ = farm.dispatch()
    farm.say(claimed(first), claimed(second))
    for _ in range(60):
        watch.wait(10)
        farm.say(heartbeat(first), heartbeat(second))
    assert farm.task(third).status is TaskStatus.DISPATCHED
    farm.say(done(first))
    watch.wait(farm.settings.unclaimed_s + 5)
    assert farm.task(third).status is TaskStatus.READY


def test_an_unclaimed_order_whose_artifact_is_there_was_done(farm: Farm, watch: Watch) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    _store(farm, order)
    watch.wait(65)
    assert farm.task(order).status is TaskStatus.DONE


def test_a_new_broker_has_no_orders_so_all_go_back_at_once_and_the_stream_begins_again(
    farm: Farm, watch: Watch
) -> None:
    job_id = farm.planned()
    running, *waiting = farm.dispatch()
    farm.say(claimed(running))
    assert watch.reconciler.take_back_all(sent_until_s=farm.now_s - 1, now_s=farm.now_s) == 0
    assert watch.reconciler.take_back_all(sent_until_s=farm.now_s, now_s=farm.now_s) == len(waiting)
    assert {farm.task(order).status for order in waiting} == {TaskStatus.READY}
    assert farm.task(running).status is TaskStatus.RUNNING
    assert farm.job(job_id).dispatched == 0
    with farm.database.reading() as session:
        assert current(session).stream_position == "0-0"


def test_a_job_ends_though_no_worker_ever_says_that_it_is_done(farm: Farm, watch: Watch) -> None:
    job_id = farm.planned()
    farm.workers = [presence(slots=50)]
    for _ in range(4):
        for order in farm.dispatch():
            _store(farm, order)
        watch.wait(65)
    assert (farm.job(job_id).status, farm.job(job_id).frames_done) == (JobStatus.DONE, 3)


def test_a_task_whose_needs_are_done_becomes_ready_even_if_that_was_missed(farm: Farm, watch: Watch) -> None:
    job_id = farm.planned()
    for order in farm.dispatch()[:2]:
        farm.say(done(order))
    assemble = next(task for task in farm.tasks(job_id) if task.needs == "render/0001")
    assert assemble.status is TaskStatus.READY
    with farm.writing() as session:  # as if the crash had come between the two
        of_assemble = (Task.job_id == job_id, Task.sequence == assemble.sequence)
        session.execute(update(Task).where(*of_assemble).values(status=TaskStatus.WAITING))
        session.execute(update(Job).values(ready=Job.ready - 1, waiting=Job.waiting + 1))
    watch.look()
    assert farm.tasks(job_id)[assemble.sequence].status is TaskStatus.READY


def test_a_job_that_has_ended_and_does_not_know_it_ends(farm: Farm, watch: Watch) -> None:
    job_id = farm.planned()
    farm.work()
    with farm.writing() as session:
        session.execute(update(Job).values(status=JobStatus.RUNNING))
    watch.look()
    assert farm.job(job_id).status is JobStatus.DONE


def test_a_pause_that_no_rule_asks_for_ends_and_a_right_one_does_not(farm: Farm, watch: Watch) -> None:
    farm.planned()
    first, second, *_ = farm.dispatch()
    farm.say(claimed(first), failed(first, code="store-full"))
    assert watch.reconciler.end_long_pauses(now_s=farm.now_s) == 0
    farm.now_s -= 3600
    farm.say(claimed(second), failed(second, code="store-full"))
    assert watch.reconciler.end_long_pauses(now_s=farm.now_s) == 1
    assert farm.task(first).not_before_s is None
    assert farm.task(second).not_before_s == farm.now_s + farm.settings.deferral_s
    farm.now_s += farm.settings.deferral_s
    assert {order.task_id for order in farm.dispatch()} == {first.task_id, second.task_id}


def test_wrong_counts_are_found_at_start(farm: Farm, watch: Watch) -> None:
    job_id = farm.planned()
    right = farm.job(job_id).ready
    assert watch.reconciler.start() == 0
    with farm.writing() as session:
        session.execute(update(Job).values(ready=77))
    assert watch.reconciler.start() == 1
    assert farm.job(job_id).ready == right


def test_old_events_are_forgotten_and_the_newest_kept(farm: Farm, watch: Watch) -> None:
    farm.planned()
    farm.work()
    watch.reconciler.settings = farm.settings.model_copy(update={"events_kept": 5})
    watch.look()
    from service.db import events as event_rows

    with farm.database.reading() as session:
        kept = event_rows.after(session, 0, job_id=None, limit=100)
        assert [row.id for row in kept] == list(range(kept[-1].id - 4, kept[-1].id + 1))
