"""The probe's result becomes tasks, and a crash anywhere in between is gone on from."""

from __future__ import annotations

import json
from typing import Any

import pytest
from sqlalchemy import text, update

from lippmann.errors import StoreUnavailable
from lippmann.job.messages.events import ProbeResult
from lippmann.job.messages.orders import TaskKind
from lippmann.job.resolved import StoredPlan
from lippmann.job.spec import JobSpec
from lippmann.job.states import JobStatus, TaskStatus
from lippmann.plan.tasks import plan_sheet, plan_tasks
from service.coordinator.background_jobs import FIRST_PAUSE_S, LONGEST_PAUSE_S, ON_ROWS, BackgroundJobs
from service.db import tasks as task_rows
from service.db.tables import Job
from service.jobs import planner as plan
from service.jobs.commands import remove_job, retry_job
from service.settings import FailureLimit
from tests.builders_service import PROBE, Farm, claimed, done

LONG = {"frames": "1-8", "outputs": ["views.mp4"]}
"""25 tasks after the probe: three chunks of ten."""


@pytest.fixture(autouse=True)
def _small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(task_rows, "CHUNK", 10)


class Crash(BaseException):
    """The end of the process: nobody catches it."""


def _probed(farm: Farm, **changes: Any) -> str:
    job_id = farm.submit(**changes)
    (order,) = farm.dispatch()
    farm.say(done(order))
    return job_id


def _expected(farm: Farm, job_id: str) -> list[tuple[int, str, str]]:
    job = farm.job(job_id)
    tasks = plan_tasks(JobSpec.model_validate(job.spec), StoredPlan.model_validate(job.plan))
    return [(0, "probe", ""), *((task.sequence, task.kind.value, task.artifact) for task in tasks)]


def _rows(farm: Farm, job_id: str) -> list[tuple[int, str, str]]:
    return [(task.sequence, task.kind.value, task.artifact) for task in farm.tasks(job_id)]


def test_the_rows_are_the_plan_and_the_counts_are_the_rows(farm: Farm) -> None:
    job_id = farm.planned(**LONG)
    job = farm.job(job_id)
    assert _rows(farm, job_id) == _expected(farm, job_id)
    assert (job.ready, job.waiting, job.done) == (16, 9, 1)
    assert job.total_px == sum(task.weight_px for task in farm.tasks(job_id))


def test_the_plan_is_an_artifact_that_workers_read(farm: Farm) -> None:
    job_id = farm.planned()
    sheet = json.loads(farm.store.get_bytes(f"{job_id}/plan.json"))
    assert sheet == {
        "tile_rows": 2, "tile_cols": 1, "probe_start_s": PROBE.start_s, "probe_s_per_px": PROBE.s_per_px,
        "renders": True,
    }  # fmt: skip


def test_a_job_runs_only_when_every_task_is_in(farm: Farm) -> None:
    job_id = _probed(farm, **LONG)
    statuses = []
    while farm.background_jobs.run_round(slots=2, now_s=farm.now_s):
        statuses.append((farm.job(job_id).status, len(farm.tasks(job_id))))
        assert farm.dispatch() == []
    assert statuses == [(JobStatus.PROBING, n) for n in (1, 11, 21)]
    assert (farm.job(job_id).status, len(farm.tasks(job_id))) == (JobStatus.RUNNING, 26)


@pytest.mark.parametrize("crash_at", range(1, 9))
def test_a_crash_at_any_step_of_planning_leaves_nothing_missing_and_nothing_twice(
    farm: Farm, monkeypatch: pytest.MonkeyPatch, crash_at: int
) -> None:
    job_id = _probed(farm, **LONG)
    steps = 0

    def crashing(function: Any) -> Any:
        def step(*args: Any, **more: Any) -> Any:
            nonlocal steps
            steps += 1
            if steps == crash_at:
                raise Crash
            answer = function(*args, **more)
            steps += 1
            if steps == crash_at:
                raise Crash
            return answer

        return step

    with monkeypatch.context() as patched:
        patched.setattr(farm.store, "put_bytes", crashing(farm.store.put_bytes))
        patched.setattr(plan, "insert_tasks", crashing(plan.insert_tasks))
        with pytest.raises(Crash):
            farm.plan()
    # A new process knows nothing.
    farm.background_jobs = BackgroundJobs(farm.database, farm.store, farm.settings, kinds=ON_ROWS)
    farm.plan()
    assert _rows(farm, job_id) == _expected(farm, job_id)
    assert (farm.job(job_id).status, farm.job(job_id).ready) == (JobStatus.RUNNING, 16)


def test_frames_share_the_slots_of_a_worker_only_if_it_has_nothing_else_to_do(farm: Farm) -> None:
    probe = PROBE.model_copy(update={"parallel": True, "s_per_px": 1e-4})
    still: dict[str, Any] = {"frames": "1", "render": {"tiles": "auto"}, "rig": {"lens_array": {"count": [100, 100]}}}
    grids = []
    for _ in range(2):
        job_id = farm.submit(**still)
        order = next(order for order in farm.dispatch() if order.job_id == job_id)
        farm.say(claimed(order), done(order).model_copy(update={"probe": probe}))
        while farm.background_jobs.run_round(slots=2, workers=1, now_s=farm.now_s):
            pass
        grids.append(StoredPlan.model_validate(farm.job(job_id).plan).tile_rows)
        farm.dispatch()
    assert grids == [1, 4], "the second one is planned while the first one renders"


def test_a_plan_once_decided_stays_though_the_farm_has_grown(farm: Farm) -> None:
    job_id = _probed(farm, **(LONG | {"render": {"tiles": "auto"}}))
    farm.background_jobs.run_round(slots=1, now_s=farm.now_s)
    decided = farm.job(job_id).plan
    farm.background_jobs = BackgroundJobs(farm.database, farm.store, farm.settings, kinds=ON_ROWS)
    while farm.background_jobs.run_round(slots=1000, now_s=farm.now_s):
        pass
    assert farm.job(job_id).plan == decided
    assert _rows(farm, job_id) == _expected(farm, job_id)


def _away(*_: Any) -> None:
    raise StoreUnavailable


def test_a_store_that_is_away_only_delays_the_plan(farm: Farm, monkeypatch: pytest.MonkeyPatch) -> None:
    job_id = _probed(farm)
    with monkeypatch.context() as patched:
        patched.setattr(farm.store, "put_bytes", _away)
        farm.plan()
    assert farm.job(job_id).status is JobStatus.PROBING
    farm.now_s += FIRST_PAUSE_S
    farm.plan()
    assert farm.job(job_id).status is JobStatus.RUNNING


def test_a_background_job_that_fails_pauses_longer_each_time_and_keeps_no_other_job_waiting(
    farm: Farm, monkeypatch: pytest.MonkeyPatch
) -> None:
    stuck = farm.planned()
    farm.work()
    tries = []

    def refuse(name: str) -> None:
        tries.append(farm.now_s)
        raise PermissionError(name)

    monkeypatch.setattr(farm.store, "delete", refuse)
    with farm.writing() as session:
        remove_job(session, stuck)
    begun_s = farm.now_s
    other = _probed(farm)
    for _ in range(20):
        farm.plan()
        farm.now_s += 1
    assert farm.job(other).status is JobStatus.RUNNING
    assert len(farm.dispatch()) == 4
    assert [at_s - begun_s for at_s in tries] == [0, 1, 3, 7, 15]
    monkeypatch.undo()
    monkeypatch.setattr(task_rows, "CHUNK", 10)
    farm.now_s += LONGEST_PAUSE_S
    farm.plan()
    with farm.database.reading() as session:
        assert session.get(Job, stuck) is None


def test_a_job_whose_numbers_cannot_be_planned_fails_and_says_so(farm: Farm) -> None:
    job_id = _probed(farm)
    with farm.writing() as session:  # as an older release could have written it
        session.execute(update(Job).values(probe={"start_s": 0.5, "s_per_px": 8.5e303, "tileable": True}))
    farm.plan()
    job = farm.job(job_id)
    assert (job.status, job.error_code, job.background_job) == (JobStatus.FAILED, "unplannable", None)
    assert "s_per_px" in (job.error_message or "")
    with farm.writing() as session:
        retry_job(session, job_id, now_s=farm.now_s, limit=FailureLimit(0.1, 3))
    farm.now_s += LONGEST_PAUSE_S
    farm.plan()
    assert farm.job(job_id).status is JobStatus.FAILED


def test_a_leader_that_was_replaced_does_not_write_over_the_plan(farm: Farm, monkeypatch: pytest.MonkeyPatch) -> None:
    """The old leader has just read that nothing is decided when the new one decides, and plans everything."""
    job_id = _probed(farm, render={"tiles": "auto"})
    decide, new = plan_sheet, BackgroundJobs(farm.database, farm.store, farm.settings, kinds=ON_ROWS)

    def late(spec: JobSpec, probe: ProbeResult, **how: Any) -> StoredPlan:
        monkeypatch.setattr(plan, "plan_sheet", decide)
        while new.run_round(slots=1, now_s=farm.now_s):
            pass
        return decide(spec, probe, **how).model_copy(update={"tile_rows": 7})

    monkeypatch.setattr(plan, "plan_sheet", late)
    farm.plan()
    stored = json.loads(farm.store.get_bytes(f"{job_id}/plan.json"))
    # The previews are for the planner alone; an older worker refuses what it does not know, and needs no camera.
    assert stored | {"previews": [1, 2, 3], "camera": None} == farm.job(job_id).plan
    assert not {"previews", "camera"} & stored.keys()
    assert _rows(farm, job_id) == _expected(farm, job_id)


def test_stages_let_go_what_needs_them_when_all_of_their_tasks_are_done(farm: Farm) -> None:
    job_id = farm.planned()
    first, second, *_ = farm.dispatch()
    assemble = 3
    farm.say(done(first))
    assert farm.tasks(job_id)[assemble].status is TaskStatus.WAITING
    farm.say(done(second))
    assert farm.tasks(job_id)[assemble].status is TaskStatus.READY


def test_no_transaction_inserts_more_than_a_chunk(farm: Farm, monkeypatch: pytest.MonkeyPatch) -> None:
    sizes: list[int] = []
    insert = plan.insert_tasks

    def count(session: Any, job_id: str, tasks: Any) -> None:
        sizes.append(len(tasks))
        insert(session, job_id, tasks)

    monkeypatch.setattr(plan, "insert_tasks", count)
    _probed(farm, **LONG)
    farm.plan()
    assert sizes == [10, 10, 5]


def test_previews_come_first_and_are_those_of_the_first_turn_of_a_motion_that_repeats(farm: Farm) -> None:
    job_id = farm.planned(frames="1-8", clock={"repeat_frames": 5}, outputs=[])
    plan_row = farm.job(job_id).plan
    assert plan_row is not None
    assert plan_row["previews"] == [1, 3, 5]
    farm.work()
    frames = [order.frame for order in farm.queue.orders if order.kind is TaskKind.ASSEMBLE]
    assert frames == [1, 3, 5, 2, 4, 6, 7, 8]


def test_the_tasks_of_a_large_job_are_counted_for_the_plans_of_the_database(farm: Farm) -> None:
    farm.planned(**LONG)
    by_sqlite = "SELECT count(*) FROM sqlite_stat1 WHERE tbl = 'tasks'"
    by_postgresql = "SELECT reltuples FROM pg_class WHERE relname = 'tasks'"
    with farm.database.reading() as session:
        counted = session.scalar(text(by_sqlite if farm.database.is_sqlite else by_postgresql))
    assert counted == (6 if farm.database.is_sqlite else 26)
