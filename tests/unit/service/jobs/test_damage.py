"""Damage is repaired and not reported: what a task or a user finds damaged is made again, once, by the farm itself."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import pytest
from sqlalchemy import text

from lippmann.digest import Digest, digest_of
from lippmann.job.messages.events import Event
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.states import JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from service.db.counters import recount
from service.jobs import artifact_repair
from service.jobs.artifact_repair import repair_tasks
from service.jobs.verification import Damage, examine, expected_artifacts, verify_job
from tests.builders_service import Client, Farm, claimed, done, failed
from tests.waiting import until

Change = Callable[[bytes], bytes | None]


def cut(data: bytes) -> bytes:
    return data[:-3]


def flipped(data: bytes) -> bytes:
    return data[:-1] + bytes([data[-1] ^ 8])


def emptied(data: bytes) -> bytes:
    return b""


def deleted(data: bytes) -> None:
    return None


CHANGES = (cut, flipped, emptied, deleted)
TILE, MASTER, VIDEO = "tiles/0002/01-00.exr", "orthoscopic/0003.exr", "video/views.mp4"


def damage(farm: Farm, job_id: str, name: str, change: Change = flipped) -> None:
    changed = change(farm.store.files.pop(f"{job_id}/{name}"))
    if changed is not None:
        farm.store.files[f"{job_id}/{name}"] = changed


class Workers:
    """Workers that verify what they read and store what they make, as those of the farm do."""

    def __init__(self, farm: Farm) -> None:
        self.farm = farm
        self.made: Counter[str] = Counter()
        """How often each artifact that marks a task as done was made."""
        self.before: Callable[[Order], None] = lambda order: None
        """Called before an order is done."""

    def work(self, rounds: int = 60) -> None:
        """Do every order, and let the coordinator repair, until nothing changes any more."""
        idle = 0
        for _ in range(rounds):
            self.farm.now_s += 10
            orders = self.farm.dispatch()
            for order in orders:
                self.before(order)
                self.farm.say(claimed(order), self.perform(order))
            self.farm.repair()
            self.farm.plan()
            idle = 0 if orders else idle + 1
            if idle == 3:
                return

    def perform(self, order: Order) -> Event:
        """Return the event with which an order ends."""
        for name, digest in order.digests.items():
            found = examine(self.farm.store, order.job_id, name, digest)
            if found is not None:
                code = "artifact-missing" if found[0] is Damage.MISSING else "artifact-broken"
                return failed(order, code=code, artifact=name)
        return done(order, digests=self._make(order))

    def _make(self, order: Order) -> dict[str, Digest]:
        task = self.farm.task(order)
        files, stored = self.farm.store.files, {}
        if f"{order.job_id}/{task.artifact}" not in files:
            self.made[task.artifact] += 1
        for name in expected_artifacts(self.farm.job(order.job_id).parsed_spec, task):
            data = files.setdefault(f"{order.job_id}/{name}", f"the pixels of {name}".encode())
            stored[name] = digest_of([data])
        return stored


@pytest.fixture
def workers(api_farm: Farm) -> Workers:
    return Workers(api_farm)


@pytest.fixture
def job_id(api_farm: Farm) -> str:
    return api_farm.planned()


def is_right(farm: Farm, job_id: str) -> None:
    """Check that a job is done, whole and counted right."""
    row = farm.job(job_id)
    assert (row.status, row.error_code, row.background_job) == (JobStatus.DONE, None, None)
    assert list(verify_job(farm.database, farm.store, job_id)) == []
    with farm.writing() as session:
        assert recount(session, job_id) is False
    tasks = farm.tasks(job_id)
    assert row.done_px == sum(task.weight_px for task in tasks) == row.total_px
    assert row.frames_done == row.frames_total
    assert {task.error_code for task in tasks} == {None}


def once_before(workers: Workers, kind: TaskKind, act: Callable[[], None]) -> None:
    """Do something once, before the first order of a kind whose inputs are all there."""
    todo = [act]

    def before(order: Order) -> None:
        if order.kind is kind and (order.frame in (2, None)) and todo:
            todo.pop()()

    workers.before = before


@pytest.mark.parametrize("change", CHANGES)
def test_a_tile_that_is_damaged_before_its_assembly_is_rendered_again_and_no_other(
    workers: Workers, job_id: str, change: Change
) -> None:
    farm = workers.farm
    once_before(workers, TaskKind.ASSEMBLE, lambda: damage(farm, job_id, TILE, change))
    workers.work()
    is_right(farm, job_id)
    assert {name for name, count in workers.made.items() if count > 1} == {TILE}
    (maker,) = (task for task in farm.tasks(job_id) if task.artifact == TILE)
    assert (maker.repairs, maker.attempt_number) == (1, 2)
    (assembly,) = (task for task in farm.tasks(job_id) if task.artifact == names.thumb_name(2))
    assert (assembly.failures, assembly.attempt_number) == (0, 2)


@pytest.mark.parametrize("change", CHANGES)
def test_a_master_that_is_damaged_before_an_output_is_made_again_and_no_other(
    workers: Workers, job_id: str, change: Change
) -> None:
    farm = workers.farm
    once_before(workers, TaskKind.ENCODE, lambda: damage(farm, job_id, MASTER, change))
    workers.work()
    is_right(farm, job_id)
    assert {name for name, count in workers.made.items() if count > 1} == {names.thumb_name(3)}


def test_a_master_and_a_tile_of_its_frame_that_are_damaged_are_both_made_again(workers: Workers, job_id: str) -> None:
    farm = workers.farm

    def both() -> None:
        damage(farm, job_id, "orthoscopic/0002.exr")
        damage(farm, job_id, TILE, deleted)

    once_before(workers, TaskKind.ENCODE, both)
    workers.work()
    is_right(farm, job_id)
    assert {name for name, count in workers.made.items() if count > 1} == {TILE, names.thumb_name(2)}


def test_two_outputs_that_find_the_same_master_damaged_have_it_made_again_once(api_farm: Farm) -> None:
    workers, job_id = Workers(api_farm), api_farm.planned(outputs=["views.mp4", "centre.mp4"])
    once_before(workers, TaskKind.ENCODE, lambda: damage(api_farm, job_id, MASTER))
    workers.work()
    is_right(api_farm, job_id)
    assert workers.made[names.thumb_name(3)] == 2


def test_a_tile_that_is_damaged_again_and_again_ends_with_a_clear_error(
    workers: Workers, job_id: str, api: Client
) -> None:
    farm = workers.farm

    def before(order: Order) -> None:
        if order.kind is TaskKind.ASSEMBLE and order.frame == 2:
            damage(farm, job_id, TILE, cut)

    workers.before = before
    workers.work()
    row = farm.job(job_id)
    assert (row.status, row.error_code) == (JobStatus.FAILED, "artifact-broken")
    assert TILE in (row.error_message or "")
    assert "made again" in (row.error_message or "")
    assert workers.made[TILE] == 2
    (assembly,) = (task for task in farm.tasks(job_id) if task.artifact == names.thumb_name(2))
    assert assembly.attempt_number == 2
    workers.before = lambda order: None
    assert api.post(f"/api/v1/jobs/{job_id}/retry").status_code == 200
    workers.work()
    is_right(farm, job_id)
    assert workers.made[TILE] == 3


def test_whole_artifacts_that_a_worker_cannot_read_count_as_failures(workers: Workers, job_id: str) -> None:
    farm = workers.farm
    orders = []
    for _ in range(20):
        farm.now_s += 10
        for order in farm.dispatch():
            if order.kind is TaskKind.ENCODE:
                orders.append(order)
                farm.say(claimed(order), failed(order, code="artifact-broken", artifact=MASTER))
            else:
                farm.say(claimed(order), workers.perform(order))
        farm.repair()
    assert farm.job(job_id).status is JobStatus.FAILED
    assert len(orders) == farm.settings.failures_allowed
    assert workers.made[names.thumb_name(3)] == 1


def test_an_assembly_that_is_taken_back_waits_for_a_tile_that_is_taken_back_too(
    workers: Workers, job_id: str, api: Client
) -> None:
    farm = workers.farm
    workers.work()
    damage(farm, job_id, TILE)
    damage(farm, job_id, "views/0002.exr")
    api.post(f"/api/v1/jobs/{job_id}/repair")
    farm.repair()
    statuses = {task.artifact: task.status for task in farm.tasks(job_id)}
    assert (statuses[TILE], statuses[names.thumb_name(2)]) == (TaskStatus.READY, TaskStatus.WAITING)


def test_an_output_that_is_ready_waits_again_for_a_master_that_is_taken_back(
    workers: Workers, job_id: str, api: Client
) -> None:
    farm = workers.farm
    while farm.job(job_id).frames_done < 3:
        workers.work(rounds=1)
    damage(farm, job_id, MASTER)
    assert api.get(url(job_id, MASTER)).status_code == 503
    statuses = {task.artifact: task.status for task in farm.tasks(job_id)}
    assert (statuses[names.thumb_name(3)], statuses[VIDEO]) == (TaskStatus.READY, TaskStatus.WAITING)


@pytest.mark.parametrize("change", CHANGES)
def test_repair_makes_everything_again_that_is_damaged_in_a_done_job_and_nothing_else(
    workers: Workers, job_id: str, api: Client, change: Change
) -> None:
    farm = workers.farm
    workers.work()
    is_right(farm, job_id)
    before, damaged = dict(farm.store.files), (TILE, MASTER, VIDEO, "thumbs/0001.webp")
    for name in damaged:
        damage(farm, job_id, name, change)
    answer = api.post(f"/api/v1/jobs/{job_id}/repair")
    assert (answer.status_code, answer.json()["status"]) == (200, "running")
    assert farm.dispatch() == []
    workers.work()
    is_right(farm, job_id)
    assert farm.store.files == before
    again = {name for name, count in workers.made.items() if count > 1}
    assert again == {TILE, VIDEO, names.thumb_name(3), names.thumb_name(1)}


def test_repair_of_a_whole_job_ends_done_without_any_work(workers: Workers, job_id: str, api: Client) -> None:
    workers.work()
    made = dict(workers.made)
    api.post(f"/api/v1/jobs/{job_id}/repair")
    workers.work()
    is_right(workers.farm, job_id)
    assert workers.made == made


def test_repair_continues_a_cancelled_job_and_repairs_it(workers: Workers, job_id: str, api: Client) -> None:
    farm = workers.farm
    workers.work(rounds=1)
    assert api.post(f"/api/v1/jobs/{job_id}/cancel").status_code == 200
    tile = next(name for name in workers.made if name.startswith("tiles/"))
    damage(farm, job_id, tile)
    api.post(f"/api/v1/jobs/{job_id}/repair")
    workers.work()
    is_right(farm, job_id)
    assert workers.made[tile] == 2


def test_repair_is_refused_while_a_job_runs(workers: Workers, job_id: str, api: Client) -> None:
    assert api.post(f"/api/v1/jobs/{job_id}/repair").status_code == 409


def a_user_repairs(workers: Workers, api: Client, job_id: str) -> None:
    workers.work()
    for frame in (1, 2, 3):
        damage(workers.farm, job_id, f"tiles/000{frame}/00-00.exr")
    api.post(f"/api/v1/jobs/{job_id}/repair")


def an_attempt_finds_it(workers: Workers, api: Client, job_id: str) -> None:
    def lose_tiles() -> None:
        for column in ("00", "01"):
            damage(workers.farm, job_id, f"tiles/0002/{column}-00.exr", deleted)

    once_before(workers, TaskKind.ASSEMBLE, lose_tiles)


def the_doctor_repairs(workers: Workers, api: Client, job_id: str) -> None:
    workers.work()
    damage(workers.farm, job_id, TILE)
    damage(workers.farm, job_id, MASTER)
    repair_tasks(
        workers.farm.database, workers.farm.store, job_id, [task.sequence for task in workers.farm.tasks(job_id)]
    )


@pytest.mark.parametrize("begin", [a_user_repairs, an_attempt_finds_it, the_doctor_repairs])
def test_others_write_while_damaged_artifacts_are_deleted_from_a_slow_store(
    workers: Workers, job_id: str, api: Client, monkeypatch: pytest.MonkeyPatch,
    begin: Callable[[Workers, Client, str], None],
) -> None:  # fmt: skip
    farm, deleted = workers.farm, list[str]()
    delete = farm.store.delete

    def delete_while_others_write(name: str) -> None:
        with farm.writing() as session:
            session.execute(text("SELECT 1"))  # begins the transaction
            delete(name)
        deleted.append(name)

    monkeypatch.setattr(farm.store, "delete", delete_while_others_write)
    monkeypatch.setattr(artifact_repair, "DELETE_S", 0.0)  # so each task is taken back by a transaction of its own
    begin(workers, api, job_id)
    workers.work()
    is_right(farm, job_id)
    assert len(deleted) >= 2


def url(job_id: str, name: str) -> str:
    return f"/api/v1/jobs/{job_id}/artifacts/{name}"


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("name", [TILE, MASTER, VIDEO])
def test_a_damaged_artifact_of_a_done_job_is_not_served_and_is_made_again(
    workers: Workers, job_id: str, api: Client, name: str, change: Change
) -> None:
    farm = workers.farm
    workers.work()
    whole = farm.store.files[f"{job_id}/{name}"]
    damage(farm, job_id, name, change)
    answer = api.get(url(job_id, name))
    assert (answer.status_code, answer.json()["code"]) == (503, "artifact-repairing")
    assert int(answer.headers["Retry-After"]) > 0
    assert farm.job(job_id).status is JobStatus.RUNNING
    assert api.get(url(job_id, name)).status_code == 503
    workers.work()
    is_right(farm, job_id)
    answer = api.get(url(job_id, name))
    assert (answer.status_code, answer.content) == (200, whole)
    assert sum(workers.made.values()) == len(farm.tasks(job_id)) - 1 + 1


def test_an_artifact_that_is_damaged_twice_is_made_again_once_by_itself_and_then_by_repair(
    workers: Workers, job_id: str, api: Client
) -> None:
    farm = workers.farm
    workers.work()
    damage(farm, job_id, VIDEO)
    assert api.get(url(job_id, VIDEO)).status_code == 503
    workers.work()
    damage(farm, job_id, VIDEO)
    answer = api.get(url(job_id, VIDEO))
    assert (answer.status_code, answer.json()["code"]) == (500, "artifact-broken")
    assert "repair" in answer.json()["detail"]
    assert farm.job(job_id).status is JobStatus.DONE
    api.post(f"/api/v1/jobs/{job_id}/repair")
    workers.work()
    is_right(farm, job_id)
    assert workers.made[VIDEO] == 3
    damage(farm, job_id, VIDEO)
    assert api.get(url(job_id, VIDEO)).status_code == 503


def test_a_master_of_a_running_job_that_a_user_finds_damaged_is_made_again_before_the_outputs(
    workers: Workers, job_id: str, api: Client
) -> None:
    farm = workers.farm
    master = "orthoscopic/0001.exr"
    statuses: list[int] = []

    def before(order: Order) -> None:
        if order.kind is TaskKind.ASSEMBLE and order.frame == 3 and not statuses:
            damage(farm, job_id, master)
            statuses.append(api.get(url(job_id, master)).status_code)

    workers.before = before
    workers.work()
    is_right(farm, job_id)
    assert statuses == [503]
    assert workers.made[names.thumb_name(1)] == 2
    (video,) = (task for task in farm.tasks(job_id) if task.kind is TaskKind.ENCODE)
    assert video.attempt_number == 1


def test_a_failed_job_is_not_continued_by_a_reader(workers: Workers, job_id: str, api: Client) -> None:
    farm = workers.farm
    workers.work(rounds=1)
    assert api.post(f"/api/v1/jobs/{job_id}/cancel").status_code == 200
    tile = next(name for name in workers.made if name.startswith("tiles/"))
    damage(farm, job_id, tile)
    assert api.get(url(job_id, tile)).status_code == 500
    assert farm.job(job_id).status is JobStatus.CANCELLED


def test_an_artifact_that_is_not_made_yet_is_not_found(workers: Workers, job_id: str, api: Client) -> None:
    assert api.get(url(job_id, MASTER)).status_code == 404
    assert api.get(url(job_id, "exports/nothing.png")).status_code == 404


def test_a_damaged_large_artifact_is_never_sent_to_its_end(
    workers: Workers, job_id: str, api: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    farm = workers.farm
    monkeypatch.setattr("service.jobs.artifact_guard.SMALL_BYTES", 4)
    workers.work()
    whole = farm.store.files[f"{job_id}/{VIDEO}"]
    assert api.get(url(job_id, VIDEO)).content == whole
    damage(farm, job_id, VIDEO)
    received = b""
    try:
        received = api.get(url(job_id, VIDEO)).content
    except Exception:  # the transfer breaks off
        received = b""
    assert len(received) < len(whole)
    assert farm.job(job_id).status is JobStatus.RUNNING
    workers.work()
    assert api.get(url(job_id, VIDEO)).content == whole


def test_a_range_of_a_damaged_large_artifact_has_it_verified_in_the_background(
    workers: Workers, job_id: str, api: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    farm = workers.farm
    monkeypatch.setattr("service.jobs.artifact_guard.SMALL_BYTES", 4)
    workers.work()
    damage(farm, job_id, VIDEO)
    assert api.get(url(job_id, VIDEO), headers={"Range": "bytes=0-3"}).status_code == 206
    until(lambda: farm.job(job_id).status is JobStatus.RUNNING)


def test_an_artifact_of_a_task_without_digests_is_served_unless_it_is_empty_or_missing(
    workers: Workers, job_id: str, api: Client
) -> None:
    farm = workers.farm
    workers.work()
    for order in [task for task in farm.tasks(job_id) if task.artifact == VIDEO]:
        with farm.writing() as session:
            row = session.get_one(type(order), (job_id, order.sequence))
            row.digests = None
    damage(farm, job_id, VIDEO, flipped)
    assert api.get(url(job_id, VIDEO)).status_code == 200
    damage(farm, job_id, VIDEO, emptied)
    assert api.get(url(job_id, VIDEO)).status_code == 503
    workers.work()
    is_right(farm, job_id)
    assert {task.status for task in farm.tasks(job_id)} == {TaskStatus.DONE}


def test_a_thumbnail_that_is_missing_in_a_done_job_is_made_again_when_the_page_asks_for_it(
    workers: Workers, job_id: str, api: Client
) -> None:
    workers.work()
    damage(workers.farm, job_id, "thumbs/0001.webp", deleted)
    assert api.get(url(job_id, "thumbs/0001.webp")).status_code == 503
    workers.work()
    is_right(workers.farm, job_id)
    assert api.get(url(job_id, "thumbs/0001.webp")).status_code == 200


def test_a_head_of_a_damaged_artifact_leaves_the_answer_to_the_get_that_follows(
    workers: Workers, job_id: str, api: Client
) -> None:
    workers.work()
    damage(workers.farm, job_id, VIDEO)
    assert api.head(url(job_id, VIDEO)).status_code == 200
    damage(workers.farm, job_id, VIDEO, deleted)
    assert api.head(url(job_id, VIDEO)).status_code == 503


def test_a_name_that_leads_out_of_the_job_is_not_found(workers: Workers, job_id: str, api: Client) -> None:
    assert api.get(url(job_id, "video/%2e%2e/%2e%2e/x")).status_code == 404
