"""Why jobs and tasks wait, told from rows that the farm itself has written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from lippmann.job.messages.events import PresenceFault
from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import TaskStatus
from service.api.waits import job_waits, task_waits
from service.db import coordinator as coordinator_rows
from service.db.tables import BackgroundJob, Job
from service.db.waiting import LINE
from service.jobs.commands import cancel_job, pause_job, prioritise_job, repair_job, retry_job
from service.jobs.farm_pause import pause_for_farm
from service.schemas.answer import utc
from service.schemas.farm import Fault
from service.schemas.wait import Wait, WaitCode
from tests.builders_service import Farm, claimed, declined, done, failed, owner, presence
from tests.unit.service.coordinator.test_large_jobs import counted

SCRATCH_FULL = PresenceFault(code="disk-full", message="no room in /scratch")
TEN_FRAMES = {"frames": "1-10", "outputs": []}


@pytest.fixture
def farm(farm: Farm, monkeypatch: pytest.MonkeyPatch) -> Farm:
    """Lend a farm that has a leader for a long time."""
    monkeypatch.setattr(coordinator_rows, "clock_s", lambda _session, *, local_s: local_s)
    with farm.writing() as session:
        coordinator_rows.acquire_leadership(session, "me", now_s=farm.now_s, until_s=farm.now_s + 1e6)
    return farm


def of_jobs(farm: Farm, **outlook: Any) -> dict[str, Wait]:
    with farm.database.reading() as session:
        return job_waits(session, session.query(Job).all(), farm.outlook(**outlook))


def of_job(farm: Farm, job_id: str, **outlook: Any) -> Wait:
    return of_jobs(farm, **outlook)[job_id]


def of_tasks(farm: Farm, job_id: str, **outlook: Any) -> dict[int, Wait]:
    with farm.database.reading() as session:
        return task_waits(session, session.get_one(Job, job_id), farm.tasks(job_id), farm.outlook(**outlook))


def codes(waits: Sequence[Wait | None]) -> set[str | None]:
    return {None if wait is None else str(wait.code) for wait in waits}


def test_a_new_job_is_about_to_start_and_one_that_works_or_has_ended_does_not_wait(farm: Farm) -> None:
    job_id = farm.submit()
    assert of_job(farm, job_id).code is WaitCode.STARTING
    (probe,) = farm.dispatch()
    assert of_job(farm, job_id).code is WaitCode.STARTING  # its order is in the queue, and both slots are free
    farm.say(claimed(probe))
    assert of_jobs(farm) == {}
    farm.say(done(probe))
    farm.plan()
    farm.work()
    assert of_jobs(farm) == {}
    assert of_tasks(farm, job_id) == {}


def test_a_pause_by_a_user_and_one_by_the_farm_are_told_apart_whatever_else_is_the_case(farm: Farm) -> None:
    job_id, other = farm.planned_jobs(2)
    with farm.writing() as session:
        pause_job(session, job_id, now_s=farm.now_s)
        row = session.get_one(Job, other)
        pause_for_farm(session, row, code="store-full", reason="The store is full.", now_s=farm.now_s)
    assert of_job(farm, job_id, broker=False).code is WaitCode.PAUSED
    wait = of_job(farm, other, broker=False)
    assert (wait.code, wait.fault) == (WaitCode.PAUSED_BY_FARM, "store-full")
    assert "The store is full." in wait.message
    assert codes([*of_tasks(farm, other).values()]) == {"paused-by-farm"}


def test_without_a_leader_nothing_is_dispatched(farm: Farm) -> None:
    job_id = farm.planned()
    farm.now_s += 2e6
    assert of_job(farm, job_id).code is WaitCode.NO_COORDINATOR
    with farm.writing() as session:
        coordinator_rows.release_leadership(session, "me")
    assert of_job(farm, job_id, broker=False).code is WaitCode.NO_COORDINATOR


def test_background_jobs_are_named_as_what_they_do(farm: Farm) -> None:
    job_id = farm.submit()
    for order in farm.dispatch():
        farm.say(claimed(order), done(order))
    assert of_job(farm, job_id).code is WaitCode.PREPARATION
    farm.plan()
    farm.work()
    with farm.writing() as session:
        repair_job(session, job_id)
    assert of_job(farm, job_id).code is WaitCode.VERIFICATION


def test_a_retry_prepares_its_tasks(farm: Farm) -> None:
    job_id = farm.planned()
    with farm.writing() as session:
        cancel_job(session, job_id, now_s=farm.now_s)
        retry_job(
            session, job_id, now_s=farm.now_s, limit=farm.settings.failure_limit
        ).background_job = BackgroundJob.RETRY
    assert of_job(farm, job_id).code is WaitCode.PREPARATION


def test_a_fault_of_the_farm_is_the_reason_of_queued_jobs_too(farm: Farm) -> None:
    job_id = farm.submit()
    fault = Fault(component="store", code="store-full", message="The store has no room left.", since_s=farm.now_s)
    with farm.writing() as session:
        coordinator_rows.set_faults(session, [fault])
    wait = of_job(farm, job_id)
    assert (wait.code, wait.fault, wait.message) == (WaitCode.FARM_FAULT, "store-full", "The store has no room left.")


def test_workers_that_are_away_at_fault_or_do_not_claim_are_told_apart(farm: Farm) -> None:
    job_id = farm.planned()
    assert of_job(farm, job_id, broker=False).code is WaitCode.BROKER_AWAY
    wait = of_job(farm, job_id, not_claiming=["w1"])
    assert (wait.code, wait.workers) == (WaitCode.NOT_CLAIMING, ("w1",))
    farm.workers = [presence("w1"), presence("w2").model_copy(update={"fault": SCRATCH_FULL})]
    wait = of_job(farm, job_id, not_claiming=["w1"])
    assert (wait.code, wait.fault) == (WaitCode.FARM_FAULT, "disk-full")
    assert "w2: no room in /scratch" in wait.message
    farm.workers = []
    assert of_job(farm, job_id).code is WaitCode.NO_WORKER
    farm.workers = [presence("w1"), presence("w2")]
    assert of_job(farm, job_id, not_claiming=["w1"]).code is WaitCode.STARTING


def test_a_task_names_the_unfinished_tasks_of_the_stage_that_it_needs(farm: Farm) -> None:
    job_id = farm.planned(frames="1-2")
    tasks = farm.tasks(job_id)
    first_tiles = [f"{job_id}-{task.sequence}" for task in tasks if task.frame == 1 and task.kind is TaskKind.RENDER]
    assembly = next(task.sequence for task in tasks if task.kind is TaskKind.ASSEMBLE)
    output = tasks[-1].sequence
    waits = of_tasks(farm, job_id)
    assert (waits[assembly].code, waits[assembly].tasks) == (WaitCode.EARLIER_STAGE, tuple(first_tiles))
    assert waits[assembly].message == "It needs 2 tasks of the stage render/0001 that are not done."
    assert waits[output].message == "It needs 2 tasks of the stage assemble that are not done."
    tile, *_ = farm.dispatch()
    farm.say(claimed(tile), done(tile))
    assert of_tasks(farm, job_id)[assembly].tasks == (first_tiles[1],)


def test_a_stage_with_many_tasks_names_ten_of_them(farm: Farm) -> None:
    job_id = farm.planned(frames="1-120")
    wait = of_tasks(farm, job_id)[farm.tasks(job_id)[-1].sequence]
    assert wait.message == "It needs 120 tasks of the stage assemble that are not done."
    assert len(wait.tasks) == 10


def test_a_task_that_could_not_read_an_artifact_waits_for_its_repair(farm: Farm) -> None:
    job_id = farm.planned(frames="1", outputs=[])
    for tile in farm.dispatch():
        farm.say(claimed(tile), done(tile))
    (assembly,) = farm.dispatch()
    farm.say(claimed(assembly), failed(assembly, code="artifact-missing", frame=1, artifact="tiles/0001-0-0.exr"))
    (wait,) = of_tasks(farm, job_id).values()
    assert (wait.code, wait.fault) == (WaitCode.ARTIFACT_REPAIR, "artifact-missing")


def test_the_pause_after_a_failure_ends_at_a_time_and_says_what_failed(farm: Farm) -> None:
    job_id = farm.submit()
    (probe,) = farm.dispatch()
    farm.say(claimed(probe), failed(probe))
    for wait in (of_job(farm, job_id), of_tasks(farm, job_id)[0]):
        assert (wait.code, wait.fault) == (WaitCode.RETRY_DELAY, "render-failed")
        assert wait.until_at == utc(farm.now_s + farm.settings.retry_pause_s)
        assert wait.message == "1 attempt failed, and it is tried again in 2 s: render-failed happened"
    farm.now_s += farm.settings.retry_pause_s
    assert of_job(farm, job_id).code is WaitCode.STARTING


def test_the_pause_after_a_second_loss_says_what_was_lost(farm: Farm) -> None:
    job_id = farm.submit()
    for _ in range(2):
        (probe,) = farm.dispatch()
        farm.say(claimed(probe), failed(probe, code="lost"))
    wait = of_job(farm, job_id)
    assert (wait.code, wait.fault) == (WaitCode.RETRY_DELAY, "lost")
    assert wait.message == "2 attempts failed, and it is tried again in 2 s: lost happened"


def test_what_something_else_prevented_is_deferred_and_no_failure(farm: Farm) -> None:
    job_id = farm.submit()
    (probe,) = farm.dispatch()
    farm.say(claimed(probe), failed(probe, code="disk-full"))
    wait = of_job(farm, job_id)
    assert (wait.code, wait.fault) == (WaitCode.DEFERRED, "disk-full")
    assert wait.until_at == utc(farm.now_s + farm.settings.deferral_s)


def test_a_job_waits_for_busy_workers_because_it_avoids_the_free_one(farm: Farm) -> None:
    bad, good = presence("bad"), presence("good")
    farm.workers = [bad, good]
    job_id = farm.submit()
    (probe,) = farm.dispatch()
    farm.say(claimed(probe, "bad"), failed(probe, "bad"))
    farm.now_s += farm.settings.retry_pause_s
    (again,) = farm.dispatch()
    assert again.avoid == ("bad",)
    farm.workers = [bad.model_copy(update={"holds": ()}), good.model_copy(update={"holds": ("a", "b")})]
    farm.say(declined(again, "bad"))
    wait = of_tasks(farm, job_id)[0]
    assert (wait.code, wait.workers) == (WaitCode.WORKERS_AVOIDED, ("bad",))
    assert of_job(farm, job_id).code is WaitCode.WORKERS_AVOIDED
    farm.workers = [bad.model_copy(update={"holds": ()}), good.model_copy(update={"holds": ("a",)})]
    assert of_tasks(farm, job_id)[0].code is not WaitCode.WORKERS_AVOIDED


def _submitted(farm: Farm, count: int, **changes: Any) -> list[str]:
    """Submit jobs one second after the other, since ids rise with time."""
    job_ids = []
    for _ in range(count):
        farm.now_s += 1
        job_ids.append(farm.submit(**changes))
    return job_ids


def _full(farm: Farm) -> str:
    """Give all slots and all places of the queue to one job, whose id is returned."""
    job_id = farm.planned(**TEN_FRAMES)
    for order in farm.dispatch()[:2]:
        farm.say(claimed(order))
    assert (farm.job(job_id).running, farm.job(job_id).dispatched) == (2, 2)
    return job_id


def test_the_next_job_in_line_is_behind_those_that_hold_the_slots(farm: Farm) -> None:
    busy = _full(farm)
    job_id = farm.submit()
    wait = of_job(farm, job_id)
    assert (wait.code, wait.jobs) == (WaitCode.SLOTS_BUSY, (busy,))
    assert wait.message == "It is the next one, but all 2 slots are busy."


def test_a_job_is_behind_those_of_a_higher_priority(farm: Farm) -> None:
    busy = _full(farm)
    job_id, higher = farm.submit(), farm.submit()
    with farm.writing() as session:
        prioritise_job(session, higher, 90)
        prioritise_job(session, busy, 60)
    wait = of_job(farm, job_id)
    assert (wait.code, wait.jobs) == (WaitCode.HIGHER_PRIORITY, (higher, busy))
    assert of_job(farm, higher).code is WaitCode.SLOTS_BUSY
    assert of_tasks(farm, job_id)[0].code is WaitCode.HIGHER_PRIORITY


def test_a_job_whose_owner_holds_as_many_slots_as_the_key_allows_waits_for_these(farm: Farm) -> None:
    ann = owner("ann", slots=1)
    busy = farm.planned(caller=ann, **TEN_FRAMES)
    (order,) = farm.dispatch()
    farm.say(claimed(order))
    job_id = farm.submit(caller=ann, priority=90)
    wait = of_job(farm, job_id)
    assert (wait.code, wait.jobs) == (WaitCode.SLOT_LIMIT, (busy,))
    assert wait.message == "The jobs of its owner hold 1 slot; expected at most 1 (the limit slots of the key)."
    assert codes([*of_tasks(farm, job_id).values()]) == {"slot-limit"}
    assert of_job(farm, farm.submit()).code is WaitCode.STARTING, "the limit of another owner is none of this one"
    farm.say(done(order))
    assert of_job(farm, job_id).code is WaitCode.STARTING


def test_the_many_jobs_of_an_owner_at_the_limit_are_in_nobodys_way(farm: Farm) -> None:
    ann = owner("ann", slots=1)
    _submitted(farm, LINE + 1, caller=ann)
    (order,) = farm.dispatch()
    farm.say(claimed(order))
    (job_id,) = _submitted(farm, 1)
    assert of_job(farm, job_id).code is WaitCode.STARTING
    assert [order.job_id for order in farm.dispatch()] == [job_id]


def test_among_equals_a_job_is_behind_those_with_fewer_orders_or_submitted_before_it(farm: Farm) -> None:
    busy = _full(farm)
    first, second = _submitted(farm, 2)
    wait = of_job(farm, second)
    assert (wait.code, wait.jobs) == (WaitCode.FAIR_SHARE, (first,))
    next_of_busy = of_tasks(farm, busy)[min(t.sequence for t in farm.tasks(busy) if t.status is TaskStatus.READY)]
    assert (next_of_busy.code, next_of_busy.jobs) == (WaitCode.FAIR_SHARE, (first, second))


def test_the_reason_is_right_about_who_gets_the_next_slot(farm: Farm) -> None:
    """What the reasons say of the next round is what the scheduler does in it."""
    busy = _full(farm)
    waiting = _submitted(farm, 4)
    with farm.writing() as session:
        prioritise_job(session, waiting[3], 70)
    running = [order for order in farm.queue.orders if order.job_id == busy][1:3]
    farm.say(*(done(order) for order in running))
    said = {job_id for job_id in waiting if of_job(farm, job_id).code is WaitCode.STARTING}
    assert said == {order.job_id for order in farm.dispatch()}
    assert said == {waiting[3], waiting[0]}


def test_a_task_is_behind_the_tasks_of_its_own_job_and_an_order_behind_the_running_ones(farm: Farm) -> None:
    job_id = _full(farm)
    waits = of_tasks(farm, job_id)
    by_status = {
        status: codes([waits.get(task.sequence) for task in farm.tasks(job_id) if task.status is status])
        for status in TaskStatus
    }
    assert by_status[TaskStatus.RUNNING] == {None}
    assert by_status[TaskStatus.DISPATCHED] == {"order-sent"}
    assert by_status[TaskStatus.READY] == {"earlier-tasks"}
    assert by_status[TaskStatus.WAITING] == {"earlier-stage"}
    sent = next(task for task in farm.tasks(job_id) if task.status is TaskStatus.DISPATCHED)
    assert waits[sent.sequence].message == "Its order is in the queue, and all 2 slots are busy."


def test_orders_in_the_queue_say_which_jobs_hold_the_slots(farm: Farm) -> None:
    busy = farm.planned(frames="1", outputs=[])
    for order in farm.dispatch():
        farm.say(claimed(order))
    job_id = farm.submit()
    assert [order.job_id for order in farm.dispatch()] == [job_id]
    wait = of_job(farm, job_id)
    assert (wait.code, wait.jobs) == (WaitCode.ORDER_SENT, (busy,))


def test_every_code_is_the_reason_of_some_test_here_or_of_one_on_workers() -> None:
    text = Path(__file__).read_text() + Path(__file__).with_name("test_waiting_for_workers.py").read_text()
    assert [code for code in WaitCode if f"WaitCode.{code.name}" not in text and f'"{code}"' not in text] == []


def test_a_page_of_jobs_takes_the_same_number_of_queries_however_many_wait(farm: Farm) -> None:
    numbers = []
    for count in (1, 20):
        for _ in range(count):
            farm.submit()
        with farm.database.reading() as session:
            rows = session.query(Job).all()
            with counted(farm) as seen:
                assert len(job_waits(session, rows, farm.outlook())) == len(rows)
        numbers.append(len(seen))
    assert numbers[0] == numbers[1] <= 6
