"""Why a job waits for workers: what they lack, and when they take orders again."""

from __future__ import annotations

from typing import Any

import pytest
from sqlalchemy import update

from lippmann.job.messages.events import Presence
from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import TaskStatus
from service.api.waits import job_waits, task_waits
from service.db import coordinator as coordinator_rows
from service.db.tables import Job
from service.schemas.answer import utc
from service.schemas.wait import Wait, WaitCode
from tests.builders_service import Farm, claimed, done, presence


@pytest.fixture
def farm(farm: Farm) -> Farm:
    """Lend a farm that has a leader for a long time."""
    with farm.writing() as session:
        coordinator_rows.acquire_leadership(session, "me", now_s=farm.now_s, until_s=farm.now_s + 1e6)
    return farm


def worker(name: str, slots: int = 2, **changes: Any) -> Presence:
    return presence(name, slots).model_copy(update=changes)


def of_job(farm: Farm, job_id: str) -> Wait | None:
    with farm.database.reading() as session:
        return job_waits(session, session.query(Job).all(), farm.outlook()).get(job_id)


@pytest.mark.parametrize(
    ("needs", "message"),
    [
        ({"tags": ["gpu"]}, "No worker that is online has the tag gpu, which the job asks for."),
        ({"pool": "day"}, "No worker that is online has the pool day, which the job asks for."),
        ({"memory_mb": 64_000}, "No worker that is online has 64000 MB for a task, which the job asks for."),
        (
            {"tags": ["fast"], "memory_mb": 32_000},
            "No worker that is online has everything that the job asks for; big lacks the tag fast.",
        ),
        (
            {"pool": "night", "tags": ["fast"]},
            "No worker that is online has everything that the job asks for; fast lacks the pool night.",
        ),
    ],
)
def test_what_no_worker_has_is_named(farm: Farm, needs: dict[str, Any], message: str) -> None:
    farm.workers = [worker("fast", tags=("fast",)), worker("night", pool="night"), worker("big", memory_mb=32_000)]
    wait = of_job(farm, farm.submit(workers=needs))
    assert wait is not None
    assert (wait.code, wait.message) == (WaitCode.NO_FITTING_WORKER, message)


@pytest.mark.parametrize(("requirement", "engine"), [('{"engine":"mitsuba"}', "Mitsuba"), ("", "POV-Ray")])
def test_the_engine_that_no_worker_has_is_named(farm: Farm, requirement: str, engine: str) -> None:
    engines = {"Mitsuba": ("povray",), "POV-Ray": ("mitsuba",)}[engine]
    farm.workers = [worker("a", engines=engines, povray="none")]
    job_id = farm.submit()
    with farm.writing() as session:
        session.execute(update(Job).values(requirement=requirement))
    wait = of_job(farm, job_id)
    assert wait is not None
    message = f"No worker that is online has the engine {engine}, which the job asks for."
    assert (wait.code, wait.message) == (WaitCode.NO_FITTING_WORKER, message)


def test_an_assembly_of_a_job_of_mitsuba_waits_for_no_mitsuba(farm: Farm) -> None:
    farm.workers = [worker("mi", 4, engines=("povray", "mitsuba"))]
    job_id = farm.planned(frames="1-20")
    with farm.writing() as session:
        session.execute(update(Job).values(requirement='{"engine":"mitsuba"}'))
    for order in farm.dispatch():
        farm.say(claimed(order), done(order))
    farm.workers = [worker("pov", 2, holds=())]
    with farm.database.reading() as session:
        ready = [task for task in farm.tasks(job_id) if task.status is TaskStatus.READY]
        waits = task_waits(session, session.get_one(Job, job_id), ready, farm.outlook())
    codes = {kind: {waits[task.sequence].code for task in ready if task.kind is kind} for kind in TaskKind}
    assert codes[TaskKind.RENDER] == {WaitCode.NO_FITTING_WORKER}
    assert codes[TaskKind.ASSEMBLE] == {WaitCode.STARTING, WaitCode.EARLIER_TASKS}


def test_a_job_without_a_pool_says_so_where_every_worker_has_one(farm: Farm) -> None:
    farm.workers = [worker("night", pool="night")]
    wait = of_job(farm, farm.submit())
    assert wait is not None
    assert (wait.code, wait.message) == (WaitCode.NO_FITTING_WORKER, "No worker that is online is outside all pools.")


def test_workers_that_are_drained_or_closed_are_named_with_the_time_at_which_they_open(farm: Farm) -> None:
    opens_s = farm.now_s + 3600
    farm.workers = [
        worker("a", tags=("gpu",), closed="draining"),
        worker("b", tags=("gpu",), closed="hours", opens_s=opens_s),
        worker("c", tags=("gpu",), protocol=0, oldest_protocol=0, version="0.0.1"),
        worker("plain"),
    ]
    wait = of_job(farm, farm.submit(workers={"tags": ["gpu"]}))
    assert wait is not None
    assert (wait.code, wait.until_at, wait.workers) == (WaitCode.WORKERS_CLOSED, utc(opens_s), ("a", "b", "c"))
    assert "a is drained; b is outside its hours until " in wait.message
    assert "c runs Lippmann 0.0.1, whose messages this service does not understand" in wait.message


def test_a_job_that_fits_workers_waits_for_their_slots_and_not_for_those_of_others(farm: Farm) -> None:
    farm.workers = [worker("with", 1, tags=("gpu",), holds=("a",)), worker("plain", 4, holds=())]
    (holder,) = farm.planned_jobs(1, workers={"tags": ["gpu"]}, frames="1-9")
    orders = farm.dispatch()
    assert len(orders) == 2
    waiting = farm.submit(workers={"tags": ["gpu"]})
    wait = of_job(farm, waiting)
    assert wait is not None
    assert (wait.code, wait.jobs) == (WaitCode.SLOTS_BUSY, (holder,))
    sent = of_job(farm, holder)
    assert sent is not None
    assert sent.code is WaitCode.ORDER_SENT
    plain = of_job(farm, farm.submit())
    assert plain is not None
    assert plain.code is WaitCode.STARTING


def test_tasks_beyond_the_limit_of_their_job_say_so(farm: Farm) -> None:
    farm.workers = [worker("w", 8)]
    job_id = farm.planned(slots=1, frames="1-3")
    (order,) = farm.dispatch()
    farm.say(claimed(order))
    with farm.database.reading() as session:
        waits = task_waits(session, session.get_one(Job, job_id), farm.tasks(job_id), farm.outlook())
    wait = next(each for sequence, each in sorted(waits.items()) if each.code is not WaitCode.EARLIER_STAGE)
    assert (wait.code, wait.message) == (
        WaitCode.SLOT_LIMIT, "It holds 1 slot; expected at most 1 (slots of the job).",
    )  # fmt: skip


def test_a_job_starts_on_an_open_worker_while_drained_ones_still_render(farm: Farm) -> None:
    farm.workers = [worker("a", 4)]
    (holder,) = farm.planned_jobs(1, frames="1-20")
    orders = farm.dispatch()
    farm.say(*(claimed(order, "a") for order in orders[:4]))
    farm.say(*(event(order) for order in orders[4:] for event in (claimed, done)))
    farm.workers = [worker("a", 4, closed="draining"), worker("b", 1)]
    wait = of_job(farm, farm.submit(priority=90))
    assert wait is not None
    assert (wait.code, farm.job(holder).running) == (WaitCode.STARTING, 4)
