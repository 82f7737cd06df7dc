"""Whether the artifacts of a job are there and whole, by the digests that its tasks reported."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from lippmann.digest import Digest, digest_of
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.spec import parse_spec
from lippmann.job.states import JobStatus
from lippmann.plan.makers import Maker, maker_of
from service.errors import NotFound
from service.jobs.verification import Damage, Finding, expected_artifacts, verify_job
from tests.builders_service import SPEC, Farm, claimed, done


def made(farm: Farm, order: Order) -> dict[str, Digest]:
    """Store the artifacts of an order as a worker does, and return what it reports."""
    task = farm.task(order)
    names = expected_artifacts(farm.job(order.job_id).parsed_spec, task)
    digests = {}
    for name in names:
        data = f"{name} of {order.job_id}".encode()
        farm.store.files[f"{order.job_id}/{name}"] = data
        digests[name] = digest_of([data])
    return digests


def work(farm: Farm, *, reports: bool = True) -> list[Order]:
    """Do every order; return them."""
    every: list[Order] = []
    while orders := farm.dispatch():
        every += orders
        for order in orders:
            stored = made(farm, order)
            farm.say(claimed(order), done(order, digests=stored if reports else None))
    return every


def findings(farm: Farm, job_id: str) -> list[tuple[str, Damage]]:
    return [(each.artifact, each.damage) for each in verify_job(farm.database, farm.store, job_id)]


@pytest.fixture
def job_id(farm: Farm) -> str:
    return farm.planned(capture={"depth": True}, outputs=["views.mp4", "view_grid.png"])


def test_a_whole_job_has_no_findings(farm: Farm, job_id: str) -> None:
    work(farm)
    assert farm.job(job_id).status is JobStatus.DONE
    assert findings(farm, job_id) == []


DAMAGED: list[tuple[Callable[[bytes], bytes | None], Damage]] = [
    (lambda data: data[:-1], Damage.SIZE),
    (lambda data: b"", Damage.SIZE),
    (lambda data: bytes([data[0] ^ 1]) + data[1:], Damage.CONTENT),
    (lambda data: None, Damage.MISSING),
]


@pytest.mark.parametrize(("change", "damage"), DAMAGED)
@pytest.mark.parametrize(
    "name",
    ["tiles/0002/01-00.exr", "depth-tiles/0001/00-00.exr", "orthoscopic/0003.exr", "thumbs/0001.webp",
     "video/views.mp4", "exports/view_grid.png.json"],
)  # fmt: skip
def test_each_damage_of_each_artifact_is_found(
    farm: Farm, job_id: str, name: str, change: Callable[[bytes], bytes | None], damage: Damage
) -> None:
    work(farm)
    changed = change(farm.store.files.pop(f"{job_id}/{name}"))
    if changed is not None:
        farm.store.files[f"{job_id}/{name}"] = changed
    assert findings(farm, job_id) == [(name, damage)]
    (finding,) = verify_job(farm.database, farm.store, job_id)
    maker = next(task for task in farm.tasks(job_id) if task.sequence == finding.sequence)
    assert Maker(maker.kind, maker.frame, maker.tile, maker.output) == maker_of(farm.job(job_id).parsed_spec, name)
    assert finding.message.startswith(name)


def test_tasks_that_reported_no_digests_are_examined_for_being_there(farm: Farm, job_id: str) -> None:
    work(farm, reports=False)
    assert findings(farm, job_id) == []
    farm.store.files[f"{job_id}/views/0001.exr"] = b""
    del farm.store.files[f"{job_id}/depth-tiles/0002/00-00.exr"]
    farm.store.files[f"{job_id}/orthoscopic/0001.exr"] += b"longer"
    assert findings(farm, job_id) == [
        ("views/0001.exr", Damage.SIZE),
        ("depth-tiles/0002/00-00.exr", Damage.MISSING),
    ]


def test_only_done_tasks_are_examined(farm: Farm, job_id: str) -> None:
    for order in farm.dispatch():
        farm.say(claimed(order))
    assert findings(farm, job_id) == []


def test_a_job_that_does_not_exist_is_not_found(farm: Farm) -> None:
    with pytest.raises(NotFound):
        list(verify_job(farm.database, farm.store, "01hzzzzzzzzzzzzzzzzzzzzzzz"))


def test_an_order_has_the_digests_of_what_its_task_reads(farm: Farm, job_id: str) -> None:
    orders = work(farm)
    tasks = {order.task_id: farm.task(order) for order in orders}
    known = {name: pair for task in tasks.values() for name, pair in (task.digests or {}).items()}
    for order in orders:
        if order.kind is TaskKind.RENDER:
            assert order.digests == {}
        if order.kind is TaskKind.ASSEMBLE:
            stem = f"{order.frame:04d}"
            tiles = [
                f"{folder}/{stem}/{tile}.exr" for folder in ("tiles", "depth-tiles") for tile in ("00-00", "01-00")
            ]
            assert order.digests == {name: Digest(*known[name]) for name in tiles}
        if order.kind is TaskKind.ENCODE:
            masters = [f"{folder}/{frame:04d}.exr" for folder in ("orthoscopic", "depth") for frame in (1, 2, 3)]
            assert order.digests == {name: Digest(*known[name]) for name in masters}


@pytest.mark.parametrize(
    "name", ["log/render-0001-00-00/1.txt", "pov/0001/00-00.pov", "job.json", "plan.json", "video/other.mp4", "tiles/x"]
)
def test_what_no_task_makes_has_no_maker(name: str) -> None:
    assert maker_of(parse_spec(SPEC), name) is None


def test_a_finding_says_which_job_it_is_about(farm: Farm, job_id: str) -> None:
    work(farm)
    del farm.store.files[f"{job_id}/thumbs/0002.webp"]
    (finding,) = verify_job(farm.database, farm.store, job_id)
    assert isinstance(finding, Finding)
    assert finding.job_id == job_id
