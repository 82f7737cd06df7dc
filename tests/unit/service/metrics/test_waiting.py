"""How much work waits."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from sqlalchemy import update

from lippmann.job.rendering.workers import JobRequirement, WorkerRequirement
from lippmann.job.states import JobStatus
from service.db import farm as farm_rows
from service.db.farm import WantRow
from service.db.tables import Job
from service.jobs.commands import cancel_job, pause_job
from service.metrics.waiting import waiting_work, waiting_work_by_engine, waiting_work_for
from tests.builders_service import Farm, claimed, done, presence


@pytest.mark.parametrize(
    ("rows", "waiting", "wanted"),
    [
        ([], 0, 0),
        ([("ann", None, "", 10, 2, 3)], 12, 15),
        ([("ann", 4, "", 10, 2, 3)], 12, 5),
        ([("ann", 6, "", 10, 2, 3)], 12, 6),
        ([("ann", None, "", 200, 0, 0)], 200, 100),
        ([("ann", 4, "", 10, 0, 0), ("bob", 4, "", 10, 0, 0)], 20, 8),
        # Two keys of one owner: what the jobs of one hold counts against the limit of the other.
        ([("ann", 10, "", 3, 0, 0), ("ann", 4, "", 9, 0, 0)], 12, 7),
        ([("ann", 2, "", 9, 0, 0), ("ann", 10, "", 3, 4, 0)], 16, 7),
    ],
)
def test_the_wanted_slots_are_those_that_the_owners_may_have(
    rows: Sequence[WantRow], waiting: int, wanted: int
) -> None:
    work = waiting_work(rows, max_slots=100)
    assert (work.waiting_tasks, work.wanted_slots) == (waiting, wanted)


def test_the_limit_of_the_farm_counts_if_that_of_a_key_is_higher() -> None:
    assert waiting_work([("ann", 1000, "", 200, 0, 0)], max_slots=100).wanted_slots == 100


def test_a_worker_may_do_what_its_pool_its_tags_and_its_memory_allow() -> None:
    night, large = WorkerRequirement(pool="night", tags=("gpu",)), WorkerRequirement(memory_mb=64_000)
    rows: list[WantRow] = [("ann", 9, "", 1, 0, 0), ("ann", 9, night.text, 4, 0, 2), ("bob", None, large.text, 8, 0, 0)]

    def wanted(pool: str, *tags: str, memory_mb: int | None = None) -> int:
        return waiting_work_for(rows, max_slots=100, pool=pool, tags=tags, memory_mb=memory_mb).wanted_slots

    assert (wanted("night", "gpu"), wanted("night"), wanted(""), wanted("", memory_mb=64_000)) == (6, 0, 1, 9)
    assert waiting_work(rows, max_slots=100).wanted_slots == 15


def test_a_worker_may_do_what_its_engines_render_and_all_that_renders_nothing() -> None:
    asked = [JobRequirement(engine=engine).text for engine in ("povray", "mitsuba", "none")]
    rows: list[WantRow] = [("ann", None, text, count, 0, 0) for text, count in zip(asked, (1, 10, 100), strict=True)]

    def wanted(*engines: str) -> int:
        found = waiting_work_for(rows, max_slots=1000, pool="", tags=(), memory_mb=None, engines=engines)
        return found.wanted_slots

    assert (wanted("povray"), wanted("mitsuba"), wanted("povray", "mitsuba"), wanted()) == (101, 110, 111, 100)


def test_the_work_of_a_job_is_split_by_the_engine_that_its_tasks_need(farm: Farm) -> None:
    job_id = farm.planned(frames="1-20")
    with farm.writing() as session:
        session.execute(update(Job).values(requirement=JobRequirement(engine="mitsuba").text))
    farm.workers = [presence("mi", 4).model_copy(update={"engines": ("povray", "mitsuba")})]
    for order in farm.dispatch():
        farm.say(claimed(order), done(order))
    row = farm.job(job_id)
    with farm.database.reading() as session:
        found = waiting_work_by_engine(farm_rows.wanted(session), max_slots=1000)
    assembling = found["none"].waiting_tasks
    assert 0 < assembling < row.ready
    assert found["mitsuba"].waiting_tasks == row.ready - assembling
    assert found["povray"].waiting_tasks == 0


def figures(farm: Farm) -> tuple[int, int, int]:
    with farm.database.reading() as session:
        work = waiting_work(farm_rows.wanted(session), max_slots=100)
    return work.waiting_tasks, work.running_tasks, work.wanted_slots


def test_the_figure_follows_a_job_from_its_submission_to_its_end(farm: Farm) -> None:
    assert figures(farm) == (0, 0, 0)
    job_id = farm.submit()
    assert figures(farm) == (1, 0, 1)  # the probe
    farm.work(1)
    farm.plan()
    assert figures(farm) == (6, 0, 6)
    orders = farm.dispatch()
    farm.say(claimed(orders[0]))
    assert figures(farm) == (5, 1, 6)
    farm.say(*map(claimed, orders[1:]))
    farm.work()
    assert farm.job(job_id).status is JobStatus.RUNNING
    assert figures(farm)[1] == len(orders)


def test_a_paused_job_waits_for_no_slot_but_keeps_those_that_it_has(farm: Farm) -> None:
    job_id = farm.planned()
    orders = farm.dispatch()
    farm.say(*map(claimed, orders))
    with farm.writing() as session:
        pause_job(session, job_id, now_s=farm.now_s)
    assert figures(farm) == (0, len(orders), len(orders))
    with farm.writing() as session:
        cancel_job(session, job_id, now_s=farm.now_s)
    farm.plan()
    assert figures(farm) == (0, 0, 0)


def test_a_job_wants_no_more_slots_than_its_own_limit(farm: Farm) -> None:
    farm.planned(slots=2, frames="1-9")
    assert figures(farm) == (2, 0, 2)
    orders = farm.dispatch()
    farm.say(claimed(orders[0]))
    assert figures(farm) == (1, 1, 2)
