"""The quota of stored artifacts: what is counted, and what happens to the jobs of an owner beyond it."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import pytest
from alembic.migration import MigrationContext
from alembic.operations import Operations
from sqlalchemy import delete, func, select, update

from lippmann.digest import Digest
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.states import JobStatus, PausedBy
from service.db import usage as usage_rows
from service.db.tables import Job, OwnerUsage, StoredBundle, Task
from service.jobs.artifact_repair import take_back
from service.jobs.commands import cancel_job, remove_job, retry_job
from service.jobs.storage_quota import resume_within_quota
from service.jobs.verification import Damage, Finding
from tests.builders_service import SPEC, Client, Farm, claimed, done, failed, owner
from tests.unit.service.coordinator.test_fault_monitor import Watched
from tests.unit.service.jobs.test_limits import API, AWAY, _key

MB = 1_000_000


def stored(order: Order, megabytes: float) -> Any:
    """Return that an order is done, and stored artifacts of some size."""
    return done(order, digests={"a.exr": Digest(round(megabytes * MB) - 7, "0" * 64), "b.exr": Digest(7, "0" * 64)})


def work(farm: Farm, megabytes: float = 1.0) -> None:
    """Do what is sent until nothing is; each task but a probe stores artifacts of some size."""
    while orders := farm.dispatch():
        for order in orders:
            farm.say(claimed(order), done(order) if order.kind is TaskKind.PROBE else stored(order, megabytes))
        farm.plan()


def used(farm: Farm, owner_id: str = "k") -> int:
    """Return the bytes of an owner, which are those of the jobs and those of their tasks."""
    with farm.database.reading() as session:
        count = usage_rows.artifact_bytes(session, [owner_id]).get(owner_id, 0)
        jobs = select(Job.id).where(Job.owner_id == owner_id)
        assert count == session.scalar(select(func.sum(Job.artifact_bytes)).where(Job.owner_id == owner_id))
        assert count == session.scalar(select(func.sum(Task.stored_bytes)).where(Task.job_id.in_(jobs)))
        return count


def remove(farm: Farm, job_id: str) -> None:
    with farm.writing() as session:
        remove_job(session, job_id)
    farm.plan()


def resume(farm: Farm) -> int:
    return resume_within_quota(farm.database, now_s=farm.now_s, settings=farm.settings)


def pause_of(farm: Farm, job_id: str) -> tuple[JobStatus, PausedBy | None, str | None]:
    job = farm.job(job_id)
    return job.status, job.paused_by, job.pause_code


BEYOND = (JobStatus.PAUSED, PausedBy.FARM, "storage-quota")


def test_what_is_stored_counts_once_for_the_owner_whatever_happens_to_the_task(farm: Farm) -> None:
    job_id = farm.planned(outputs=[])
    first, second, *others = farm.dispatch()
    farm.say(claimed(first), failed(first))
    assert used(farm) == 0
    farm.say(claimed(second), stored(second, 2), stored(second, 2))
    assert used(farm) == 2 * MB
    finding = Finding(job_id, farm.task(second).sequence, "tiles/x.exr", Damage.MISSING, "gone")
    with farm.writing() as session:
        take_back(session, farm.store, job_id, [finding], by_itself=True)
    assert used(farm) == 0
    farm.now_s += 100
    farm.say(*(said for order in others for said in (claimed(order), stored(order, 3))))
    work(farm, 3)
    assert (farm.job(job_id).status, used(farm)) == (JobStatus.DONE, 9 * 3 * MB)


def test_the_bytes_of_a_removed_job_are_given_back_and_those_of_other_owners_are_their_own(farm: Farm) -> None:
    farm.submit(caller=owner("ann"), frames="1", outputs=[])
    job_id = farm.submit(frames="1", outputs=[])
    work(farm)
    assert (used(farm, "ann"), used(farm)) == (3 * MB, 3 * MB)
    remove(farm, job_id)
    with farm.database.reading() as session:
        assert usage_rows.artifact_bytes(session, ["ann", "k"]) == {"ann": 3 * MB, "k": 0}


@pytest.mark.promise("People", "The artifacts of an owner have a limit, which pauses only the jobs of this owner.")
def test_a_job_that_crosses_the_limit_is_paused_with_the_reason_and_goes_on_when_there_is_room(farm: Farm) -> None:
    ann = owner("ann", artifacts_mb=5)
    old = farm.submit(caller=ann, frames="1", outputs=[])
    work(farm)
    job_id = farm.planned(caller=ann)
    (order, *others), before = farm.dispatch(), farm.job(job_id).ready
    farm.say(*map(claimed, (order, others[0])), stored(order, 2.5))
    assert pause_of(farm, job_id) == BEYOND
    assert farm.job(job_id).pause_reason == (
        "The artifacts of its owner have 5.5 MB, expected at most 5 (the limit artifacts_mb of the key). "
        "Removed jobs make room."
    )
    assert farm.dispatch() == []
    assert farm.job(job_id).ready == before + 2, "orders that nobody had claimed are taken back"
    farm.say(stored(others[0], 0.1))
    assert used(farm, "ann") == 5.6 * MB, "running tasks finish"
    assert resume(farm) == 0
    Watched(farm).run()
    assert pause_of(farm, job_id) == BEYOND, "no fault has gone"
    remove(farm, old)
    assert resume(farm) == 1
    work(farm, 0.1)
    assert farm.job(job_id).status is JobStatus.DONE


def test_a_job_beyond_its_quota_stays_so_though_no_worker_can_do_its_work(farm: Farm) -> None:
    job_id = farm.planned(caller=owner("ann", artifacts_mb=5))
    failing, storing, *_ = farm.dispatch()
    farm.say(claimed(failing), failed(failing, code="store-full"), claimed(storing), stored(storing, 5.5))
    assert pause_of(farm, job_id) == BEYOND
    watched = Watched(farm)
    watched.run(after_s=1.0)
    assert pause_of(farm, job_id) == BEYOND
    watched.run(after_s=farm.settings.deferral_s)
    assert pause_of(farm, job_id) == BEYOND


def test_the_limit_of_one_owner_pauses_nobody_else_and_exactly_the_limit_is_allowed(
    make_farm: Callable[..., Farm],
) -> None:
    farm = make_farm(max_artifacts_mb=3)
    mine, other = farm.submit(frames="1", outputs=[]), farm.submit(caller=owner("ann"), frames="1-2", outputs=[])
    work(farm)
    assert (farm.job(mine).status, used(farm)) == (JobStatus.DONE, 3 * MB)
    assert pause_of(farm, other) == BEYOND
    mine = farm.submit(frames="1", outputs=[])
    work(farm, 0.0001)
    assert pause_of(farm, mine)[0] is JobStatus.PAUSED, "a byte more is not"


def test_a_job_that_ends_with_its_last_artifact_is_done_and_not_paused(farm: Farm) -> None:
    job_id = farm.planned(caller=owner("ann", artifacts_mb=1), frames="1", outputs=[])
    for _ in range(2):
        for order in farm.dispatch():
            size = 9.0 if order.kind is TaskKind.ASSEMBLE else 0.1
            farm.say(claimed(order), stored(order, size))
    assert farm.job(job_id).status is JobStatus.DONE


def test_beyond_the_limit_jobs_are_refused_with_the_limit_and_the_size_and_without_a_time(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]
) -> None:
    farm = make_farm(**AWAY, max_artifacts_mb=4)
    api, ann, bob = make_client(farm), _key(farm, "ann"), _key(farm, "bob")
    ended, paused, open_job = (api.post(f"{API}/jobs", json=SPEC, headers=ann).json()["id"] for _ in range(3))
    with farm.writing() as session:
        cancel_job(session, ended, now_s=farm.now_s)
    work(farm, 1.5)
    assert {pause_of(farm, job_id) for job_id in (paused, open_job)} == {BEYOND}
    size = used(farm, "ann") / MB
    for path, body in (("jobs", SPEC), (f"jobs/{ended}/retry", None), (f"jobs/{paused}/resume", None)):
        refused = api.post(f"{API}/{path}", json=body, headers=ann)
        assert (refused.status_code, refused.json()["code"], refused.headers.get("Retry-After")) == (
            403, "storage-quota", None,
        ), path  # fmt: skip
        limit = "at most 4 (LIPPMANN_MAX_ARTIFACTS_MB of the farm)"
        assert refused.json()["detail"] == f"the artifacts of 'ann' have {size:g} MB, expected {limit}; remove jobs"
        assert refused.json()["errors"] == [{"field": "artifacts_mb", "expected": limit, "got": f"{size:g}"}]
    assert api.post(f"{API}/jobs", json=SPEC, headers=bob).status_code == 201
    shown = api.get(f"{API}/jobs/{paused}").json()
    assert (shown["pause"]["code"], shown["wait"]["code"], shown["wait"]["fault"]) == (
        "storage-quota", "paused-by-farm", "storage-quota",
    )  # fmt: skip


def test_a_job_that_is_retried_counts_what_it_stores_again_once(farm: Farm) -> None:
    job_id = farm.planned(outputs=[])
    for order in farm.dispatch():
        farm.say(claimed(order), stored(order, 1))
    before = used(farm)
    with farm.writing() as session:
        cancel_job(session, job_id, now_s=farm.now_s)
        retry_job(session, job_id, now_s=farm.now_s, limit=farm.settings.failure_limit)
    work(farm)
    assert (before, used(farm)) == (4 * MB, 9 * MB)


def test_what_an_earlier_release_stored_is_counted_by_the_migration(farm: Farm) -> None:
    farm.planned(outputs=[])
    work(farm, 2)
    with farm.writing() as session:
        session.execute(update(Task).values(stored_bytes=0))
        session.execute(update(Job).values(artifact_bytes=0))
        session.execute(delete(OwnerUsage))
        session.execute(delete(StoredBundle))
    migration = import_module("service.db.migrations.versions.0008_quotas")
    with farm.database.connecting() as connection, Operations.context(MigrationContext.configure(connection)):
        migration._count()
    assert used(farm) == 9 * 2 * MB
