"""A job of 20,000 tasks: the work of a tick or a page does not grow with the job."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from sqlalchemy import event

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import TaskStatus
from service.api import listings as browse
from service.coordinator.scheduler import ROUND
from service.db.job_pages import JobQuery
from tests.builders_service import Farm, claimed, done, presence

FRAMES = 6_666
"""3 tasks each, one probe, one video: 20,000."""


@contextmanager
def counted(farm: Farm) -> Iterator[list[str]]:
    """Lend a list that gathers every statement."""
    seen: list[str] = []

    def note(_connection: Any, _cursor: Any, statement: str, *_: Any) -> None:
        seen.append(statement)

    engine = farm.database._engine
    event.listen(engine, "before_cursor_execute", note)
    try:
        yield seen
    finally:
        event.remove(engine, "before_cursor_execute", note)


@pytest.fixture
def database_kind() -> str:
    """Return the one kind whose statements are counted: they are the same on both."""
    return "sqlite"


@pytest.fixture
def jobs(make_farm: Callable[..., Farm]) -> list[tuple[Farm, str]]:
    """Lend a small job and a large one, each on a farm of its own."""
    small, large = make_farm(), make_farm()
    return [(small, small.planned(frames="1-9")), (large, large.planned(frames=f"1-{FRAMES}"))]


def test_a_dispatch_tick_says_as_much_to_the_database_for_a_large_job_as_for_a_small_one(
    jobs: list[tuple[Farm, str]],
) -> None:
    counts = []
    for farm, _ in jobs:
        with counted(farm) as seen:
            assert len(farm.dispatch()) == 4
        counts.append(len(seen))
    assert counts[0] == counts[1]


def test_following_an_event_does_too(jobs: list[tuple[Farm, str]]) -> None:
    counts = []
    for farm, _ in jobs:
        order, *_ = farm.dispatch()
        with counted(farm) as seen:
            farm.say(claimed(order), done(order))
        counts.append(len(seen))
    assert counts[0] == counts[1]


def test_pages_hold_what_was_asked_for_and_lead_through_every_task_once(jobs: list[tuple[Farm, str]]) -> None:
    farm, job_id = jobs[1]
    seen: list[int] = []
    cursor: str | None = None
    with farm.database.reading() as session:
        while True:
            page = browse.page_tasks(session, job_id, farm.outlook(), status=None, kind=None, cursor=cursor, limit=500)
            seen += [task.sequence for task in page.items]
            assert len(page.items) <= 500
            cursor = page.next_cursor
            if cursor is None:
                break
    assert seen == list(range(20_000))


def test_a_page_asks_the_database_a_few_times_however_long_the_job_is(jobs: list[tuple[Farm, str]]) -> None:
    for farm, job_id in jobs:
        with farm.database.reading() as session, counted(farm) as seen:
            ready, kind = TaskStatus.READY, TaskKind.RENDER
            browse.page_tasks(session, job_id, farm.outlook(), status=ready, kind=kind, cursor=None, limit=5)
            browse.page_frames(session, job_id, cursor=None, limit=5)
            session.expunge_all()
            browse.page_jobs(session, JobQuery(), farm.outlook(), cursor=None, offset=0, limit=5, counted=False)
        tasks, frames, page_of_jobs, reasons_of_tasks, reasons_of_jobs = 2, 2, 3, 6, 6
        asked = tasks + frames + page_of_jobs + reasons_of_tasks + reasons_of_jobs
        assert len([text for text in seen if text.startswith("SELECT")]) == asked


def test_a_reconciler_looks_at_no_more_than_a_chunk_of_waiting_tasks(jobs: list[tuple[Farm, str]]) -> None:
    from service.db import tasks as task_rows

    farm, job_id = jobs[1]
    with farm.database.reading() as session:
        free, reached = task_rows.overdue(session, job_id, after=-1)
        assert free == []
        assert reached is not None
        waiting = [task.sequence for task in farm.tasks(job_id) if task.status is TaskStatus.WAITING]
        assert waiting[task_rows.CHUNK - 1] == reached


def test_a_large_farm_gets_its_orders_in_rounds(jobs: list[tuple[Farm, str]]) -> None:
    farm, _ = jobs[1]
    farm.workers = [presence(slots=250)]
    assert [len(farm.dispatch()) for _ in range(4)] == [ROUND, ROUND, 500 - 2 * ROUND, 0]
