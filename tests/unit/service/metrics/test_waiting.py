"""How much work waits."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from lippmann.job.states import JobStatus
from service.db import farm as farm_rows
from service.db.farm import WantRow
from service.jobs.commands import cancel_job, pause_job
from service.metrics.waiting import waiting_work
from tests.builders_service import Farm, claimed


@pytest.mark.parametrize(
    ("rows", "waiting", "wanted"),
    [
        ([], 0, 0),
        ([("ann", None, 10, 2, 3)], 12, 15),
        ([("ann", 4, 10, 2, 3)], 12, 5),
        ([("ann", 6, 10, 2, 3)], 12, 6),
        ([("ann", None, 200, 0, 0)], 200, 100),
        ([("ann", 4, 10, 0, 0), ("bob", 4, 10, 0, 0)], 20, 8),
        # Two keys of one owner: what the jobs of one hold counts against the limit of the other.
        ([("ann", 10, 3, 0, 0), ("ann", 4, 9, 0, 0)], 12, 7),
        ([("ann", 2, 9, 0, 0), ("ann", 10, 3, 4, 0)], 16, 7),
    ],
)
def test_the_wanted_slots_are_those_that_the_owners_may_have(
    rows: Sequence[WantRow], waiting: int, wanted: int
) -> None:
    work = waiting_work(rows, max_slots=100)
    assert (work.waiting_tasks, work.wanted_slots) == (waiting, wanted)


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
