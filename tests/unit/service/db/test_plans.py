"""Every query of a busy farm finds its rows by the index that was made for it, on both databases.

The farm is large: 500 jobs that have ended, 50 that are open, and one of 20,000 tasks, nearly all of which
wait. ANALYZE has counted the rows; on SQLite a start of the service has then replaced what it counted.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from sqlalchemy import event, insert, select, text
from sqlalchemy.orm import Session

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import JobStatus, TaskStatus
from service.api.usage import usage_of
from service.coordinator.reconciler import FarmView, Reconciler
from service.db import events as event_rows
from service.db import farm as farm_rows
from service.db import job_pages, overview, task_sets
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db import usage as usage_rows
from service.db import waiting as waiting_rows
from service.db import work as work_rows
from service.db.job_pages import JobQuery, Position
from service.db.migrations import migrate
from service.db.tables import BackgroundJob, Job, JobEvent, OwnerUsage, Task
from service.jobs.limits import check_quota
from service.limits import Limits
from service.schemas.events import EventTopic
from service.schemas.job import JobSort
from tests.builders_service import CALLER, T0, Farm, claimed, done, presence

LARGE = 6_666
"""The frames of the large job: 3 tasks each, one probe, one video."""
ENDED, OPEN, SMALL = 500, 50, 50
"""The jobs that have ended, the small ones that are open, and the tasks of each."""
OWNERS = 5_000
BATCH = 200

Statement = tuple[str, Any]

PRIMARY = {
    "sqlite_autoindex_jobs_1": "jobs",
    "jobs_pkey": "jobs",
    "sqlite_autoindex_tasks_1": "tasks",
    "tasks_pkey": "tasks",
    "sqlite_autoindex_owner_usage_1": "owner_usage",
    "owner_usage_pkey": "owner_usage",
}
BY_STATUS = "ix_tasks_job_status"


@pytest.fixture(scope="module")
def farm(url: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Farm]:
    farm = Farm(url, data_dir=tmp_path_factory.mktemp("farm"))
    farm.workers = [presence(slots=BATCH)]
    large = farm.planned(frames=f"1-{LARGE}")
    _copy(farm, large, [f"0ended{i:05}" for i in range(ENDED)], status=JobStatus.DONE, tasks=TaskStatus.DONE)
    _copy(farm, large, [f"1open{i:05}" for i in range(OPEN)], status=JobStatus.RUNNING, tasks=TaskStatus.WAITING)
    with farm.writing() as session:
        progress = {"job_id": large, "topic": EventTopic.PROGRESS, "data": {}}
        session.execute(insert(JobEvent), [progress] * 5_000)
        owners = [{"owner_id": f"owner{i}", "artifact_bytes": i} for i in range(OWNERS)]
        session.execute(insert(OwnerUsage), owners)
        session.execute(text("ANALYZE"))
    migrate(farm.database)  # as at every start
    farm.database.dispose()
    yield farm
    farm.database.dispose()


@pytest.fixture(scope="module")
def job_id(farm: Farm) -> str:
    """Lend the large job."""
    with farm.database.reading() as session:
        return session.scalars(select(Job.id).where(Job.ready > 0)).one()


def _copy(farm: Farm, job_id: str, names: list[str], *, status: JobStatus, tasks: TaskStatus) -> None:
    """Store small jobs under some names: copies of a job with some of its tasks."""
    with farm.writing() as session:
        job = dict(session.execute(select(Job.__table__).where(Job.id == job_id)).mappings().one())
        query = select(Task.__table__).where(Task.job_id == job_id, Task.sequence < SMALL)
        rows = [dict(row) for row in session.execute(query).mappings()]
        counters = {each.value: len(rows) if each is tasks else 0 for each in TaskStatus}
        session.execute(insert(Job), [job | counters | {"id": name, "status": status} for name in names])
        session.execute(insert(Task), [row | {"job_id": name, "status": tasks} for name in names for row in rows])


@contextmanager
def _recorded(farm: Farm) -> Iterator[list[Statement]]:
    """Lend a list that gathers every statement with its parameters."""
    seen: list[Statement] = []

    def note(_connection: Any, _cursor: Any, statement: str, parameters: Any, *_: Any) -> None:
        if not statement.startswith("BEGIN"):
            seen.append((statement, parameters[0] if isinstance(parameters, list) else parameters))

    engine = farm.database._engine
    event.listen(engine, "before_cursor_execute", note)
    try:
        yield seen
    finally:
        event.remove(engine, "before_cursor_execute", note)


def _plan(session: Session, statement: Statement) -> list[str]:
    """Return the steps of a plan: index and condition, or SCAN and the table that is read from end to end."""
    words, parameters = statement
    connection = session.connection()
    if connection.dialect.name == "sqlite":
        rows = connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {words}", parameters).all()
        return [str(row[-1]) for row in rows if str(row[-1]).startswith(("SEARCH", "SCAN"))]
    (answer,) = connection.exec_driver_sql(f"EXPLAIN (FORMAT JSON) {words}", parameters).one()
    (tree,) = json.loads(answer) if isinstance(answer, str) else answer
    return [step for step in map(_step, _nodes(tree["Plan"])) if step]


def _nodes(node: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield node
    for below in node.get("Plans", ()):
        yield from _nodes(below)


def _step(node: dict[str, Any]) -> str | None:
    if "Index Name" in node:
        return f"SEARCH USING INDEX {node['Index Name']} {node.get('Index Cond')}"
    return f"SCAN {node['Relation Name']}" if node["Node Type"] == "Seq Scan" else None


def _indexes(plan: list[str]) -> set[str]:
    """Return the names of the indexes, with `jobs` and `tasks` for the primary keys."""
    return {_index(*step.partition("INDEX ")[2].split(maxsplit=1)) for step in plan if "INDEX " in step}


def _index(name: str, condition: str = "") -> str:
    if name == "ix_tasks_job_stage" and "stage" not in condition:
        return BY_STATUS  # both indexes begin with the same columns, so without a stage one is as good as the other
    return PRIMARY.get(name, name)


def page_of_jobs(session: Session, query: JobQuery, *, after: Position | None) -> object:
    return job_pages.page(session, query, after=after, offset=0, limit=50)


HOT: dict[str, tuple[Callable[[Session, str], object], set[str]]] = {
    "the number of outstanding orders": (lambda s, _: job_rows.outstanding(s), {"ix_jobs_busy"}),
    "the jobs with outstanding orders": (lambda s, _: job_rows.busy_ids(s), {"ix_jobs_busy"}),
    "the background jobs": (
        lambda s, _: job_rows.background_jobs(s, [BackgroundJob.PLAN, BackgroundJob.CANCEL]),
        {"ix_jobs_background_job"},
    ),
    "the jobs that wait for slots": (
        lambda s, _: job_rows.claims(s, now_s=T0),
        {"ix_jobs_status", BY_STATUS},
    ),
    "the first job that wants slots": (
        lambda s, _: job_rows.can_dispatch(s, ["", "another"], now_s=T0),
        {"ix_jobs_status", BY_STATUS},
    ),
    "the requirements of open jobs": (lambda s, _: job_rows.requirements(s), {"ix_jobs_requirement"}),
    "the requirements of jobs with outstanding orders": (
        lambda s, _: job_rows.requirements_of_busy(s),
        {"ix_jobs_busy"},
    ),
    "the jobs to reconcile": (lambda s, _: job_rows.to_reconcile(s, after="", limit=500), {"ix_jobs_status"}),
    "the best tasks of a job": (
        lambda s, job_id: task_sets.ready(s, job_id, now_s=T0, after=-1, limit=BATCH),
        {BY_STATUS},
    ),
    "the tasks of a batch of events": (
        lambda s, job_id: task_sets.states(s, [(job_id, sequence) for sequence in range(BATCH)]),
        {"tasks"},
    ),
    "the tasks that a batch makes ready": (
        lambda s, job_id: task_sets.unblock(s, [(job_id, f"render:{frame}") for frame in range(1, BATCH)]),
        {"ix_tasks_job_needs", "ix_tasks_job_stage"},
    ),
    "the outputs that the last frame makes ready": (
        lambda s, job_id: task_sets.unblock(s, [(job_id, "assemble")]),
        {"ix_tasks_job_needs", "ix_tasks_job_stage"},
    ),
    "the tasks of attempts": (lambda s, job_id: task_sets.held(s, job_id), {BY_STATUS}),
    "the attempts that may be lost": (lambda s, job_id: task_rows.held(s, [job_id]), {BY_STATUS}),
    "the tiles of frames to assemble": (
        lambda s, job_id: task_rows.done_renders(s, job_id, range(1, BATCH)),
        {"ix_tasks_job_frame"},
    ),
    "the progress of running tasks": (lambda s, job_id: task_rows.running_px(s, [job_id]), {BY_STATUS}),
    "the outputs that are done": (lambda s, job_id: task_rows.done_outputs(s, [job_id]), {"ix_tasks_job_stage"}),
    "the outputs that failed": (lambda s, job_id: task_rows.failed_outputs(s, job_id), {"ix_tasks_job_stage"}),
    "the waiting tasks that nothing prevents": (
        lambda s, job_id: task_rows.overdue(s, job_id, after=-1),
        {BY_STATUS, "ix_tasks_job_stage"},
    ),
    "the task of an output": (
        lambda s, job_id: task_rows.made_by(s, job_id, TaskKind.ENCODE, frame=None, tile=None, output="views.mp4"),
        {"ix_tasks_job_frame"},
    ),
    "a page of frames": (lambda s, job_id: task_rows.frames(s, job_id, range(1, 100)), {"ix_tasks_job_frame"}),
    "a page of tasks": (
        lambda s, job_id: task_rows.page(s, job_id, status=None, kind=None, after=500, limit=100),
        {"tasks"},
    ),
    "a page of jobs": (lambda s, _: page_of_jobs(s, JobQuery(), after=None), {"jobs"}),
    "a page of running jobs": (
        lambda s, _: page_of_jobs(s, JobQuery(statuses=(JobStatus.RUNNING,)), after=Position("2", "2")),
        {"ix_jobs_status"},
    ),
    "the pictures of a page of jobs": (
        lambda s, job_id: overview.newest_frames(s, [job_id, "0ended00001"]),
        {"jobs", BY_STATUS},
    ),
    "the tasks of a frame": (
        lambda s, job_id: task_rows.page(s, job_id, status=None, kind=None, frame=7, after=-1, limit=100),
        {"ix_tasks_job_frame"},
    ),
    "the jobs that come first, for a reason to wait": (
        lambda s, _: waiting_rows.line(s, now_s=T0, max_slots=9, held={"ann": 3}),
        {"ix_jobs_status", BY_STATUS},
    ),
    "the jobs that hold slots, for a reason to wait": (lambda s, _: waiting_rows.holders(s), {"ix_jobs_busy"}),
    "the delayed tasks of a page of jobs": (
        lambda s, job_id: waiting_rows.delayed(s, [job_id], now_s=T0),
        {"jobs", BY_STATUS},
    ),
    "the first task that may be dispatched": (
        lambda s, job_id: waiting_rows.first_ready(s, job_id, now_s=T0),
        {BY_STATUS},
    ),
    "the unfinished tasks of the stages that a page of tasks needs": (
        lambda s, job_id: waiting_rows.unfinished(s, job_id, [f"render/{frame:04d}" for frame in range(1, 50)]),
        {"ix_tasks_job_stage"},
    ),
    "the names of unfinished tasks of small stages": (
        lambda s, job_id: waiting_rows.members(s, job_id, [f"render/{frame:04d}" for frame in range(1, 50)]),
        {"ix_tasks_job_stage"},
    ),
    "what owners have stored": (
        lambda s, _: usage_rows.artifact_bytes(s, ["owner5", "owner6"]),
        {"owner_usage"},
    ),
    "the jobs that wait for room and have it": (
        lambda s, _: usage_rows.resumable(s, max_artifacts_mb=10),
        {"ix_jobs_status", "owner_usage"},
    ),
    "the tasks of open jobs, for the figures": (lambda s, _: farm_rows.tasks(s), {"ix_jobs_status"}),
    "the work that waits, for an autoscaler": (lambda s, _: farm_rows.wanted(s), {"ix_jobs_status"}),
    "the number of open jobs by status": (lambda s, _: farm_rows.jobs(s, job_rows.OPEN), {"ix_jobs_status"}),
    "the oldest job that has not begun": (lambda s, _: farm_rows.oldest_queued_s(s), {"ix_jobs_status"}),
    "the frames of the last hours": (
        lambda s, _: work_rows.finished_frames(s, begin_s=T0 - 3600, step_s=30.0),
        {"ix_tasks_ended"},
    ),
    "the slots in use in the last hours": (
        lambda s, _: work_rows.spans(s, begin_s=T0 - 3600, step_s=30.0),
        {"ix_tasks_ended"},
    ),
    "the jobs with outstanding orders, for the page of the farm": (
        lambda s, _: work_rows.busy_jobs(s, owner_id=None),
        {"ix_jobs_busy"},
    ),
    "the jobs that wait, for the page of the farm": (
        lambda s, _: work_rows.waiting_jobs(s, owner_id=None, limit=500),
        {"ix_jobs_status"},
    ),
    "the newest frame of a job": (lambda s, job_id: work_rows.newest_frame(s, job_id), {BY_STATUS}),
    "the events of a job": (
        lambda s, job_id: event_rows.after(s, 4_000, job_id=job_id[:-1], limit=100),
        {"ix_job_events_job"},
    ),
}


@pytest.mark.parametrize("name", HOT)
def test_a_hot_query_uses_its_index(farm: Farm, job_id: str, name: str) -> None:
    query, indexes = HOT[name]
    with farm.database.reading() as session, _recorded(farm) as seen:
        query(session, job_id)
        session.rollback()
        (statement,) = seen
        plan = _plan(session, statement)
    assert not [step for step in plan if step.startswith("SCAN tasks")], plan
    assert _indexes(plan) == indexes, plan


CHANGES_WITH_WORK = {JobSort.PROGRESS, JobSort.TIME_LEFT, JobSort.COST}
"""The orders by values that each batch of events writes, so that an index of them would cost each batch."""
LISTS = {
    **{sort.value: JobQuery(sort=sort) for sort in JobSort if sort not in CHANGES_WITH_WORK},
    "search": JobQuery(search="no such job"),
    "owner": JobQuery(owner="ann"),
    "seen": JobQuery(seen_by="ann", sort=JobSort.NAME),
}


@pytest.mark.parametrize("name", LISTS)
def test_a_list_is_searched_sorted_and_counted_without_the_long_rows(farm: Farm, name: str) -> None:
    with farm.database.reading() as session, _recorded(farm) as seen:
        job_pages.page(session, LISTS[name], after=None, offset=300, limit=50)
        job_pages.count(session, LISTS[name])
        plans = [_plan(session, statement) for statement in (seen[0], seen[-1])]
    if farm.database.is_sqlite:  # PostgreSQL stores the specifications elsewhere, and its rows are short
        assert [[*map(_covering, plan)] for plan in plans] == [["ix_jobs_listed"], ["ix_jobs_listed"]], plans


def _covering(step: str) -> str:
    """Return the index that a step reads instead of the rows."""
    return step.partition("COVERING INDEX ")[2].split(" ")[0]


def test_quotas_and_usage_are_counted_without_the_tasks(farm: Farm) -> None:
    with farm.database.reading() as session, _recorded(farm) as seen:
        check_quota(session, CALLER.owner_id, frames=1, limits=Limits(farm.settings, CALLER.limits))
        used = {item.name: item.used for item in usage_of(session, CALLER, farm.settings).items}
        plans = {statement[0]: _plan(session, statement) for statement in list(seen)}
    assert (used["open_jobs"], used["open_frames"]) == (OPEN + 1, (OPEN + 1) * LARGE)
    assert len(plans) >= 5
    assert not [words for words in plans if "tasks" in words]
    if farm.database.is_sqlite:  # PostgreSQL knows that some tables are empty here
        assert not [step for plan in plans.values() for step in plan if step.startswith("SCAN jobs")], plans


def test_no_statement_of_a_round_of_the_coordinator_reads_a_large_table_from_end_to_end(farm: Farm) -> None:
    with _recorded(farm) as seen:
        orders = farm.dispatch()
        farm.say(*map(claimed, orders))
        farm.say(*map(done, orders))
        assert {order.kind for order in farm.dispatch()} >= {TaskKind.ASSEMBLE}
        Reconciler(farm.database, farm.store, farm.settings).run(FarmView(now_s=farm.now_s, slots=2, is_live=True))
    large = tuple(f"SCAN {table}" for table in ("tasks", "jobs", "job_events", "owner_usage"))
    queries = {words: (words, more) for words, more in seen if words.startswith(("SELECT", "UPDATE", "DELETE"))}
    with farm.database.reading() as session:
        for statement in queries.values():
            plan = _plan(session, statement)
            assert not [step for step in plan if step.startswith(large)], (statement[0], plan)
