"""The work of the farm: running and stuck tasks, jobs that wait, the last hours, and who uses how much."""

from __future__ import annotations

from service.api.farm_history import STEPS, farm_history, slots_in_use
from service.api.farm_work import SLOW, SLOW_S, farm_work, owner_work
from service.db.coordinator import acquire_leadership
from service.db.tables import Task
from service.jobs.commands import pause_job
from service.schemas.wait import WaitCode
from service.schemas.work import FarmWork, StuckCode
from tests.builders_service import Farm, claimed, done, heartbeat, owner, presence


def _work(farm: Farm, owner_id: str | None = None) -> FarmWork:
    with farm.database.reading() as session:
        return farm_work(session, farm.outlook(), owner_id=owner_id)


def test_a_task_that_a_worker_runs_is_listed_with_a_picture_of_its_job(farm: Farm) -> None:
    job_id = farm.planned()
    order, *more = farm.dispatch()
    farm.say(claimed(order), heartbeat(order, 0.25))
    first, *others = _work(farm).tasks
    assert (first.id, first.worker, first.progress, first.stuck) == (order.task_id, "w1", 0.25, None)
    assert first.picture == "/api/v1/scenes/ball/poster.png"
    assert others
    assert {task.worker for task in others} == {None}
    farm.say(*map(claimed, more), *map(done, [order, *more]))
    farm.work(2)
    farm.dispatch()
    pictures = {task.picture for task in _work(farm).tasks}
    assert pictures == {f"/api/v1/jobs/{job_id}/artifacts/thumbs/0003.webp"}


def test_a_silent_a_slow_and_an_unclaimed_task_are_stuck(farm: Farm) -> None:
    farm.planned()
    slow, silent, *_ = farm.dispatch()
    farm.say(claimed(slow), done(slow))
    slow, *_ = farm.dispatch()
    farm.say(claimed(slow), claimed(silent))
    farm.workers = [presence(slots=9).model_copy(update={"holds": ()})]
    farm.now_s += farm.settings.unclaimed_s + 1 + SLOW_S * SLOW
    with farm.writing() as session:
        row = session.query(Task).filter(Task.attempt == slow.attempt).one()
        row.heartbeat_s = farm.now_s
    stuck = {task.id: task.stuck.code for task in _work(farm).tasks if task.stuck}
    assert stuck.pop(silent.task_id) is StuckCode.SILENT
    assert stuck.pop(slow.task_id) is StuckCode.SLOW
    assert set(stuck.values()) == {StuckCode.NOT_CLAIMED}


def test_jobs_that_wait_are_counted_by_engine_and_reason(farm: Farm) -> None:
    first, second, third = farm.planned_jobs(3)
    for job_id in (first, second):
        with farm.writing() as session:
            pause_job(session, job_id, now_s=farm.now_s)
    farm.workers = []
    with farm.writing() as session:
        acquire_leadership(session, "here", now_s=farm.now_s, until_s=farm.now_s + 9)
    paused, other = _work(farm).waiting
    assert (paused.engine, paused.code, paused.jobs, paused.first) == (
        "povray",
        WaitCode.PAUSED,
        2,
        tuple(sorted((first, second))),
    )
    assert (other.code, other.first, other.ready_tasks) == (WaitCode.NO_WORKER, (third,), 6)


def test_others_jobs_are_left_out_where_they_are_hidden(farm: Farm) -> None:
    farm.planned_jobs(1, caller=owner("ann"))
    farm.dispatch()
    waiting = farm.submit(caller=owner("bob"))
    assert {task.owner_id for task in _work(farm, "bob").tasks} == set()
    assert [item.first for item in _work(farm, "bob").waiting] == [(waiting,)]
    with farm.database.reading() as session:
        assert [item.owner_id for item in owner_work(session, owner_id="bob").items] == ["bob"]


def test_the_work_of_an_owner_is_counted_over_the_jobs(farm: Farm) -> None:
    farm.planned_jobs(2, caller=owner("ann"))
    farm.work()
    farm.submit(caller=owner("bob"))
    with farm.database.reading() as session:
        ann, bob = owner_work(session, owner_id=None).items
    assert (ann.owner_id, ann.name, ann.jobs, ann.open_jobs, ann.frames_done) == ("ann", "ann", 2, 0, 6)
    assert ann.cpu_s > 0
    assert (bob.owner_id, bob.open_jobs, bob.frames_done) == ("bob", 1, 0)


def test_the_history_counts_the_frames_that_were_finished_and_the_slots_in_use(farm: Farm) -> None:
    farm.planned()
    begun_s = farm.now_s
    while orders := farm.dispatch():
        farm.say(*map(claimed, orders))
        farm.now_s += 60
        farm.say(*map(done, orders))
    with farm.database.reading() as session:
        history = farm_history(session, hours=1, now_s=farm.now_s)
        earlier = farm_history(session, hours=1, now_s=begun_s)
        later = farm_history(session, hours=1, now_s=farm.now_s + 3600)
    assert sum(history.frames) == 3
    assert len(history.frames) == len(history.slots) == STEPS
    # Six tiles, three assemblies and a video held a slot for 60 s each.
    assert sum(history.slots) * history.step_s == 10 * 60
    assert sum(earlier.frames) in (0, 3)
    assert (sum(later.frames), sum(later.slots)) == (0, 0)


def test_a_running_task_holds_its_slot_until_now(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    farm.now_s += 600
    with farm.database.reading() as session:
        slots = farm_history(session, hours=1, now_s=farm.now_s).slots
    assert slots[-1] == 1.0
    assert sum(slots) * 30.0 == 600


def test_slots_in_use_add_up_to_the_time_of_all_tasks() -> None:
    spans = [(0, 0, 3, 6.0, 24.0), (0, 3, 2, 10.0, 66.0), (2, 3, 1, 29.0, 31.0)]
    assert sum(slots_in_use(spans, steps=4, step_s=10.0)) * 10 == 18.0 + 56.0 + 2.0
