"""Events become rows: once each, and only while their attempt owns its task."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from sqlalchemy.exc import OperationalError

from lippmann.job.messages.events import Event, EventKind
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.states import TaskStatus
from service.coordinator import event_consumer as following
from service.coordinator.event_consumer import consume_events
from service.db.coordinator import current, delete_stops, pending_stops
from service.db.tables import JobEvent
from service.jobs.commands import cancel_job, pause_job
from service.schemas.events import EventTopic
from tests.builders_service import PROBE, T0, Farm, canonical, claimed, declined, done, event, failed, heartbeat


def test_claimed_beats_and_done_write_worker_progress_and_times(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.now_s += 1
    farm.say(claimed(order, "w7"))
    farm.now_s += 5
    farm.say(heartbeat(order, 0.25, "w7"))
    task = farm.task(order)
    assert (task.status, task.worker, task.progress) == (TaskStatus.RUNNING, "w7", 0.25)
    assert (task.dispatched_s, task.claimed_s, task.heartbeat_s) == (T0, T0 + 1, T0 + 6)
    farm.say(done(order, "w7", cpu_s=3.0, wall_s=4.0))
    task = farm.task(order)
    assert (task.status, task.progress, task.cpu_s, task.wall_s, task.ended_s) == (
        TaskStatus.DONE, 1.0, 3.0, 4.0, T0 + 6,
    )  # fmt: skip


def test_a_late_event_of_an_old_attempt_is_counted_and_changes_nothing(farm: Farm) -> None:
    job_id = farm.planned()
    old, *_ = farm.dispatch()
    farm.say(claimed(old), failed(old))
    farm.now_s += 10
    new = next(order for order in farm.dispatch() if order.task_id == old.task_id)
    assert (new.attempt != old.attempt, new.attempt_number) == (True, 2)
    before = canonical(farm.task(new))
    for late in (claimed(old), heartbeat(old), done(old), failed(old, permanent=True), declined(old)):
        farm.say(late)
    assert canonical(farm.task(new)) == before
    assert farm.job(job_id).late_events == 5


def test_an_event_said_twice_changes_nothing_the_second_time(farm: Farm) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    for say in (claimed, heartbeat, done):
        farm.say(say(order))
        task, job = canonical(farm.task(order)), canonical(farm.job(job_id))
        farm.say(say(order))
        assert (canonical(farm.task(order)), canonical(farm.job(job_id))) == (task, job), say


def test_a_failure_said_twice_counts_once(farm: Farm) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order), failed(order), failed(order))
    assert (farm.task(order).failures, farm.job(job_id).late_events) == (1, 0)


def test_a_piece_of_the_stream_that_was_followed_is_not_followed_again(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    with farm.database.reading() as session:
        was = current(session).stream_position
    entries = [("900-0", claimed(order)), ("900-1", failed(order))]
    assert consume_events(farm.database, entries, was=was, now_s=farm.now_s, settings=farm.settings)
    assert not consume_events(farm.database, entries, was=was, now_s=farm.now_s, settings=farm.settings)
    assert farm.task(order).failures == 1


def test_done_is_enough_when_claimed_was_lost(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(done(order))
    assert farm.task(order).status is TaskStatus.DONE


def test_a_beat_is_as_good_as_a_claim(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(heartbeat(order, worker="w3"))
    assert (farm.task(order).status, farm.task(order).worker) == (TaskStatus.RUNNING, "w3")


def test_an_order_delivered_to_two_workers_is_done_once(farm: Farm) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order, "a"), claimed(order, "b"), done(order, "a"), done(order, "b"))
    assert (farm.task(order).worker, farm.job(job_id).done) == ("a", 2)
    assert farm.job(job_id).done_px == farm.task(order).weight_px


def test_events_of_strangers_are_ignored(farm: Farm) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    strangers = [
        order.model_copy(update={"task_id": "nonsense"}),
        order.model_copy(update={"task_id": f"{job_id}-999"}),
        order.model_copy(update={"job_id": "other"}),
    ]
    before = canonical(farm.job(job_id))
    farm.say(*(done(stranger) for stranger in strangers))
    assert canonical(farm.job(job_id)) == before


def test_an_unreadable_event_does_not_stop_the_stream(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    with farm.database.reading() as session:
        was = current(session).stream_position
    consume_events(farm.database, [("900-0", None), ("900-1", done(order))], was=was, now_s=T0, settings=farm.settings)
    assert farm.task(order).status is TaskStatus.DONE


def test_a_declined_order_rests_and_is_no_failure(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(declined(order))
    task = farm.task(order)
    assert (task.status, task.failures, task.not_before_s) == (TaskStatus.READY, 0, T0 + farm.settings.decline_pause_s)


def test_the_notes_of_a_probe_are_added_to_those_of_its_job(farm: Farm) -> None:
    job_id = farm.submit()
    before = list(farm.job(job_id).notes)
    (order,) = farm.dispatch()
    noted = PROBE.model_copy(update={"notes": ("The scene writes files.",)})
    farm.say(claimed(order), event(order, EventKind.DONE, probe=noted))
    assert farm.job(job_id).notes == [*before, "The scene writes files."]


def test_a_probe_without_a_measurement_has_failed(farm: Farm) -> None:
    farm.submit()
    (order,) = farm.dispatch()
    assert order.kind is TaskKind.PROBE
    farm.say(event(order, EventKind.DONE))
    assert (farm.task(order).status, farm.task(order).error_code) == (TaskStatus.READY, "probe-empty")


def _heard(farm: Farm, order: Order) -> list[tuple[str, str | None]]:
    with farm.database.reading() as session:
        return [
            (row.topic.value, row.data.get("status"))
            for row in session.query(JobEvent).filter(JobEvent.job_id == order.job_id).order_by(JobEvent.id)
            if row.data.get("id") == order.task_id or row.topic.value in ("job", "frame")
        ]


def test_subscribers_receive_every_status_in_order(farm: Farm) -> None:
    farm.planned(frames="1")
    order, *_ = farm.dispatch()
    for say in (claimed, heartbeat, done):
        farm.say(say(order))
    assert _heard(farm, order) == [
        ("job", "queued"), ("job", "probing"), ("job", "running"),
        ("task", "dispatched"), ("task", "running"), ("frame", "rendering"), ("task", "done"),
    ]  # fmt: skip


def test_several_events_of_a_task_in_one_batch_are_one_event_for_subscribers(farm: Farm) -> None:
    farm.planned(frames="1")
    order, *_ = farm.dispatch()
    farm.say(claimed(order), heartbeat(order), done(order))
    assert _heard(farm, order)[3:] == [("task", "dispatched"), ("task", "done"), ("frame", "rendering")]


def test_a_batch_publishes_the_progress_of_each_job_once(farm: Farm) -> None:
    jobs = farm.planned_jobs(2)
    orders = farm.dispatch()
    with farm.database.reading() as session:
        last = session.query(JobEvent).order_by(JobEvent.id.desc()).first()
        assert last is not None
    farm.say(*(said for order in orders for said in (claimed(order), done(order))))
    with farm.database.reading() as session:
        rows = session.query(JobEvent).filter(JobEvent.id > last.id, JobEvent.topic == EventTopic.PROGRESS).all()
    assert sorted(row.job_id for row in rows) == sorted(jobs)


def test_of_many_beats_of_an_attempt_only_the_last_is_written(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order), *(heartbeat(order, i / 100) for i in range(100)))
    assert farm.task(order).progress == 0.99


def _stops(farm: Farm) -> set[str]:
    with farm.database.reading() as session:
        return set(pending_stops(session))


@pytest.mark.parametrize(("say", "stops"), [(claimed, True), (heartbeat, True), (done, False), (failed, False)])
def test_who_works_on_what_is_no_longer_theirs_is_told_to_stop_again(
    farm: Farm, say: Callable[[Order], Event], stops: bool
) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    with farm.writing() as session:
        pause_job(session, job_id, now_s=farm.now_s)
        cancel_job(session, job_id, now_s=farm.now_s)
        delete_stops(session, [*pending_stops(session)])  # told, and then the broker was wiped
    assert _stops(farm) == set()
    farm.say(say(order))
    assert _stops(farm) == ({order.attempt} if stops else set())


def test_an_attempt_of_a_job_that_was_removed_is_told_to_stop(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(heartbeat(order.model_copy(update={"job_id": "gone", "task_id": "gone-7"})))
    assert _stops(farm) == {order.attempt}


def test_who_says_twice_that_it_is_done_is_not_told_to_stop(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order), heartbeat(order), done(order))
    farm.say(claimed(order), heartbeat(order), done(order))
    assert _stops(farm) == set()


def test_one_event_that_cannot_be_written_down_is_passed_over_and_counted(farm: Farm) -> None:
    job_id = farm.planned()
    first, second, third, *_ = farm.dispatch()
    broken = failed(first)
    assert broken.failure is not None
    # No event of the stream is validated like this; it stands for one that no rule foresaw.
    broken = broken.model_copy(update={"failure": broken.failure.model_copy(update={"frame": 2**70})})
    assert farm.say(claimed(first), broken, done(second), heartbeat(third, 0.25))
    assert [farm.task(order).status for order in (first, second, third)] == [
        TaskStatus.RUNNING, TaskStatus.DONE, TaskStatus.RUNNING,
    ]  # fmt: skip
    job = farm.job(job_id)
    assert (job.late_events, job.running, job.done, job.dispatched) == (1, 2, 2, 1)
    assert farm.task(third).progress == 0.25


def test_a_database_that_is_away_passes_over_nothing(farm: Farm, monkeypatch: pytest.MonkeyPatch) -> None:
    farm.planned()
    order, *_ = farm.dispatch()

    def away(*_: object, **__: object) -> None:
        raise OperationalError("UPDATE", {}, Exception("database is locked"))

    with monkeypatch.context() as patched:
        patched.setattr(following, "write_events", away)
        with pytest.raises(OperationalError):
            farm.say(done(order))
    assert farm.task(order).status is TaskStatus.DISPATCHED
    farm.say(done(order))
    assert farm.task(order).status is TaskStatus.DONE
