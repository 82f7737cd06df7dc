"""Orders go to the queues of workers that fit, and jobs hold no more slots than they ask for."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest
from sqlalchemy import update

from lippmann.job.messages.events import Presence, PresenceFault
from lippmann.job.messages.orders import TaskKind
from lippmann.job.messages.protocol import PROTOCOL
from lippmann.job.rendering.workers import WorkerRequirement
from service.claiming import ClaimWatches
from service.coordinator.loss_detector import ROUNDS, LossDetector, Sighting
from service.coordinator.reconciler import FarmView, Reconciler
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.tables import Job
from tests.builders_service import T0, Farm, claimed, done, failed, presence

GPU = {"tags": ["gpu"]}
NIGHT = {"pool": "night"}
MITSUBA = '{"engine":"mitsuba"}'
NO_ENGINE = '{"engine":"none"}'


def worker(name: str, slots: int = 2, **changes: Any) -> Presence:
    return presence(name, slots).model_copy(update=changes)


def text(given: dict[str, Any]) -> str:
    return WorkerRequirement.model_validate(given).text


def test_a_job_whose_workers_are_not_there_gets_no_order_and_keeps_none_from_others(farm: Farm) -> None:
    farm.workers = [worker("plain")]
    waiting = farm.submit(workers=GPU, priority=90)
    other = farm.submit()
    assert [order.job_id for order in farm.dispatch()] == [other]
    assert farm.dispatch() == []
    farm.workers.append(worker("with", tags=("gpu", "more")))
    (order,) = farm.dispatch()
    assert (order.job_id, order.requirement) == (waiting, '{"tags":["gpu"]}')


@pytest.mark.parametrize("memory_mb", [None, 32_000])
def test_memory_is_what_a_worker_gives_a_task(farm: Farm, memory_mb: int | None) -> None:
    farm.workers = [worker("w", memory_mb=memory_mb)]
    farm.submit(workers={"memory_mb": 64_000})
    assert farm.dispatch() == []
    farm.workers = [worker("w", memory_mb=64_000)]
    assert len(farm.dispatch()) == 1


def test_a_pool_does_its_own_jobs_and_no_others(farm: Farm) -> None:
    farm.workers = [worker("day", 1), worker("night", 3, pool="night")]
    jobs = [farm.submit(), farm.submit(workers=NIGHT)]
    for order in farm.dispatch():
        farm.say(claimed(order), done(order))
    farm.plan()
    orders = farm.dispatch()
    assert Counter((order.job_id, order.requirement) for order in orders) == {
        (jobs[0], ""): 2, (jobs[1], text(NIGHT)): 6,
    }  # fmt: skip


def test_orders_of_few_workers_are_as_many_as_those_have_slots_for(farm: Farm) -> None:
    farm.workers = [worker("with", 1, tags=("gpu",)), *(worker(f"w{i}", 4) for i in range(3))]
    tagged = farm.planned(workers=GPU, frames="1-50")
    assert len(farm.dispatch()) == 2
    plain = farm.submit(frames="1-50")
    assert {order.job_id for order in farm.dispatch()} == {plain}
    assert farm.job(tagged).dispatched == 2


def test_orders_go_only_to_workers_that_have_the_engine(farm: Farm) -> None:
    farm.workers = [worker("pov", 1)]
    meshes = farm.planned(frames="1-50")
    with farm.database.writing() as session:
        session.execute(update(Job).values(requirement=MITSUBA))
    assert farm.dispatch() == []
    farm.workers.append(worker("mi", 1, povray="none", engines=("mitsuba",)))
    assert {(order.job_id, order.requirement) for order in farm.dispatch()} == {(meshes, MITSUBA)}
    plain = farm.submit(frames="1-50")
    assert [order.job_id for order in farm.dispatch()] == [plain], "the other engine has slots of its own"
    assert farm.job(meshes).dispatched == 2


def meshes(farm: Farm, **more: Any) -> str:
    """Return a planned job of Mitsuba with rendered frames, whose assembly is ready."""
    farm.workers = [worker("mi", 4, engines=("povray", "mitsuba"))]
    job_id = farm.planned(**more)
    with farm.database.writing() as session:
        session.execute(update(Job).where(Job.id == job_id).values(requirement=MITSUBA))
    for order in farm.dispatch():
        farm.say(claimed(order), done(order))
    return job_id


def test_tasks_that_render_nothing_go_to_workers_without_the_engine_also_while_it_is_busy(farm: Farm) -> None:
    job_id = meshes(farm, frames="1-50")
    farm.workers = [worker("mi", 1, engines=("povray", "mitsuba")), worker("pov", 1)]
    orders = farm.dispatch()
    kinds = Counter((order.kind.value, order.requirement) for order in orders)
    assert kinds == {("render", MITSUBA): 2, ("assemble", NO_ENGINE): 2}
    assert farm.dispatch() == []
    assembly = next(order for order in orders if order.kind is TaskKind.ASSEMBLE)
    farm.say(claimed(assembly, "pov"), done(assembly, "pov"))
    assert [order.requirement for order in farm.dispatch()] == [NO_ENGINE], "Mitsuba has no room, others have"
    assert farm.job(job_id).dispatched == 4


def test_no_worker_with_the_engine_need_be_left_for_the_assembly(farm: Farm) -> None:
    meshes(farm, frames="1-50")
    farm.workers = [worker("pov", 1)]
    assert Counter(order.kind for order in farm.dispatch()) == {TaskKind.ASSEMBLE: 2}
    assert farm.dispatch() == []


def test_the_parts_of_a_job_share_its_limit_of_slots(farm: Farm) -> None:
    meshes(farm, slots=3, frames="1-50")
    farm.workers.append(worker("pov", 8))
    assert len(farm.dispatch()) == 3
    assert farm.dispatch() == []


def test_an_order_of_an_assembly_is_looked_for_in_its_own_queue(farm: Farm) -> None:
    meshes(farm, frames="1-50")
    farm.workers = [worker("pov", 1, holds=())]
    order, *_ = farm.dispatch()
    with farm.database.reading() as session:
        held = task_rows.held(session, job_rows.busy_ids(session))
        requirements = job_rows.requirements_of_busy(session)
        assert job_rows.requirements(session) == [MITSUBA, NO_ENGINE]
        assert job_rows.outstanding(session) == {("k", MITSUBA): 0, ("k", NO_ENGINE): 2}

    def lost(first_orders: dict[str, str | None]) -> set[str]:
        detector = LossDetector(silence_s=45.0)
        seen = [
            Sighting(
                live_s=float(second), rounds=second * ROUNDS, workers={w.name: w for w in farm.workers}, leases={},
                first_orders=first_orders, requirements=requirements,
            )
            for second in range(20)
        ]  # fmt: skip
        return {attempt for each in seen for attempt in detector.observe(held, each)}

    assert lost({"": None, MITSUBA: None, NO_ENGINE: order.attempt}) == set()
    assert order.attempt in lost({"": None, MITSUBA: None, NO_ENGINE: None})


def test_a_job_of_povray_gives_no_order_to_a_worker_without_it(farm: Farm) -> None:
    farm.workers = [worker("mi", povray="none", engines=("mitsuba",)), worker("none", povray="none")]
    farm.submit()
    assert farm.dispatch() == []


def test_a_worker_that_takes_no_orders_has_no_slots(farm: Farm) -> None:
    farm.planned(frames="1-50")
    for changes in ({"closed": "draining"}, {"protocol": PROTOCOL + 2, "oldest_protocol": PROTOCOL + 2}):
        farm.workers = [worker("w").model_copy(update=changes)]
        assert farm.dispatch() == []
    farm.workers = [worker("w"), worker("old", 5, protocol=0, oldest_protocol=0)]
    orders = farm.dispatch()
    assert len(orders) == 4
    assert {order.avoid for order in orders} == {("old",)}, "an old worker reads no directions"


def test_workers_that_do_not_fit_are_no_others_for_a_task_that_failed(farm: Farm) -> None:
    farm.workers = [worker("with", tags=("gpu",)), worker("plain")]
    farm.planned(workers=GPU)
    order = farm.dispatch()[0]
    farm.say(claimed(order, "with"), failed(order, "with"))
    farm.now_s += 60
    again = next(each for each in farm.dispatch() if each.task_id == order.task_id)
    assert again.avoid == (), "the only worker that fits has failed it"
    farm.say(claimed(again, "with"), failed(again, "with"))
    farm.workers.append(worker("second", tags=("gpu",)))
    farm.now_s += 600
    third = next(each for each in farm.dispatch() if each.task_id == order.task_id)
    assert third.avoid == ("with",)


def test_a_job_holds_no_more_slots_than_its_own_limit(farm: Farm) -> None:
    farm.workers = [worker("w", 8)]
    limited = farm.planned(slots=3, frames="1-20", priority=90)
    other = farm.submit(frames="1-20")
    assert Counter(order.job_id for order in farm.dispatch()) == {limited: 3, other: 1}
    held = [order for order in farm.queue.orders if order.job_id == limited][-3:]
    farm.say(claimed(held[0]), done(held[0]))
    assert [order.job_id for order in farm.dispatch()] == [limited]
    with farm.database.reading() as session:
        assert [row[0] for row in job_rows.claims(session, now_s=farm.now_s)] == [], "nothing is looked for in vain"


def test_an_order_behind_others_of_busy_workers_that_fit_is_not_taken_back(farm: Farm) -> None:
    busy = worker("with", 1, tags=("gpu",), holds=("a",))
    farm.workers = [busy, worker("idle", 4, holds=())]
    farm.planned(workers=GPU)
    running, waiting = farm.dispatch()
    farm.say(claimed(running, "with"))
    reconciler = Reconciler(farm.database, farm.store, farm.settings)

    def pass_by(seconds: float) -> None:
        for _ in range(int(seconds / farm.settings.reconcile_s) + 1):
            farm.now_s += farm.settings.reconcile_s
            reconciler.run(FarmView(now_s=farm.now_s, slots=5, is_live=True, workers=tuple(farm.workers)))

    pass_by(5 * farm.settings.unclaimed_s)
    assert farm.task(waiting).status == "dispatched"
    farm.workers[0] = busy.model_copy(update={"holds": ()})
    pass_by(farm.settings.unclaimed_s / 2)
    assert farm.task(waiting).status == "dispatched"
    pass_by(farm.settings.unclaimed_s)
    assert farm.task(waiting).status == "ready"


def test_an_order_is_looked_for_in_its_own_queue(farm: Farm) -> None:
    farm.workers = [worker("with", tags=("gpu",), holds=())]
    farm.planned(workers=GPU)
    first, *_ = farm.dispatch()
    with farm.database.reading() as session:
        held = task_rows.held(session, job_rows.busy_ids(session))
        requirements = job_rows.requirements_of_busy(session)

    def lost(first_orders: dict[str, str | None]) -> set[str]:
        detector = LossDetector(silence_s=45.0)
        found: set[str] = set()
        for second in range(20):
            seen = Sighting(
                live_s=float(second), rounds=second * ROUNDS, workers={w.name: w for w in farm.workers}, leases={},
                first_orders=first_orders, requirements=requirements,
            )  # fmt: skip
            found |= set(detector.observe(held, seen))
        return found

    assert lost({"": "another", text(GPU): first.attempt}) == set()
    assert lost({"": None}) == set(), "nobody has looked at the queue yet"
    assert first.attempt in lost({"": "another", text(GPU): None})


def test_workers_are_named_that_leave_an_order_of_their_own_queue() -> None:
    workers = [
        worker("with", tags=("gpu",), holds=()),
        worker("without", holds=()),
        worker("drained", tags=("gpu",), holds=(), closed="draining"),
        worker("at fault", tags=("gpu",), holds=(), fault=PresenceFault(code="disk-full", message="full")),
    ]
    watches = ClaimWatches(unmoved_s=15.0)
    assert watches.observe(workers, {"": None, text(GPU): b"a"}, now_s=T0) == {}
    found = watches.observe(workers, {"": None, text(GPU): b"a"}, now_s=T0 + 15)
    assert set(found) == {"with", "at fault"}


def test_the_number_of_queues_is_bounded_and_the_oldest_jobs_have_theirs(
    farm: Farm, monkeypatch: pytest.MonkeyPatch
) -> None:
    limited = job_rows._REQUIREMENTS.limit(2)
    monkeypatch.setattr(job_rows, "_REQUIREMENTS", limited)
    farm.workers = [worker("w", 8, memory_mb=9_000)]
    for memory_mb in (3_000, 1_000, 2_000):
        farm.submit(workers={"memory_mb": memory_mb})
        farm.now_s += 1
    with farm.database.reading() as session:
        assert job_rows.requirements(session) == [text({"memory_mb": size}) for size in (1_000, 3_000)]
    orders = farm.dispatch()
    assert {order.requirement for order in orders} == {text({"memory_mb": size}) for size in (1_000, 3_000)}


def test_what_closed_workers_still_do_takes_no_slot_of_the_open_ones(farm: Farm) -> None:
    farm.workers = [worker("day", 4), worker("gpu", 4, tags=("gpu",), pool="night")]
    job_id, other = farm.planned(frames="1-50"), farm.submit(workers={**GPU, **NIGHT})
    orders = farm.dispatch()
    assert Counter(order.job_id for order in orders) == {job_id: 8, other: 1}
    mine = [order for order in orders if order.job_id == job_id]
    farm.say(*(claimed(order, "day") for order in mine[:4]))
    farm.say(*(event(order) for order in mine[4:] for event in (claimed, done)))
    for reason in ("draining", "hours"):
        farm.workers = [each.model_copy(update={"closed": reason}) for each in farm.workers[:2]]
        farm.workers.append(worker(f"open for {reason}", 1))
        sent = farm.dispatch()
        assert [order.job_id for order in sent] == [job_id] * 2, "neither what they do nor what nobody may do counts"
        assert farm.dispatch() == []
        farm.say(*(event(order) for order in sent for event in (claimed, done)))


def test_an_order_that_an_open_worker_leaves_is_taken_back_though_closed_ones_are_busy(farm: Farm) -> None:
    farm.workers = [worker("closed", 3)]
    farm.planned(frames="1-50")
    orders = farm.dispatch()
    farm.say(*(claimed(order, "closed") for order in orders[:3]))
    farm.workers = [worker("closed", 3, closed="draining", holds=("a", "b", "c")), worker("open", 2, holds=())]
    reconciler = Reconciler(farm.database, farm.store, farm.settings)
    for _ in range(int(2 * farm.settings.unclaimed_s / farm.settings.reconcile_s)):
        farm.now_s += farm.settings.reconcile_s
        reconciler.run(FarmView(now_s=farm.now_s, slots=2, is_live=True, workers=tuple(farm.workers)))
    assert [farm.task(order).status for order in orders] == ["running"] * 3 + ["ready"] * 3
