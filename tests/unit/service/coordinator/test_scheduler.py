"""Which orders go out, how many, and what each says."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.job.messages.events import Presence
from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import TaskStatus
from service.coordinator.scheduler import OrderRate, dispatch
from service.errors import BrokerUnavailable
from service.jobs.commands import pause_job, prioritise_job
from service.jobs.fair_share import Claim, is_at_limit, share_out, slots_by_owner
from service.order_queue import OrderQueue
from tests.builders_service import Farm, claimed, done, owner, presence

claims = st.lists(
    st.builds(
        Claim,
        job_id=st.uuids().map(str),
        priority=st.integers(0, 3),
        outstanding=st.integers(0, 5),
        ready=st.integers(0, 5),
    ),
    max_size=6,
    unique_by=lambda claim: claim.job_id,
)


@given(claims=claims, room=st.integers(0, 12))
def test_what_is_shared_out_is_all_there_is_room_for_and_no_more_than_is_ready(claims: list[Claim], room: int) -> None:
    given_out = share_out(claims, room)
    assert sum(given_out.values()) == min(room, sum(claim.ready for claim in claims))
    assert all(given_out.get(claim.job_id, 0) <= claim.ready for claim in claims)


@given(claims=claims, room=st.integers(0, 12))
def test_no_job_gets_anything_while_one_of_higher_priority_could_have_more(claims: list[Claim], room: int) -> None:
    given_out = share_out(claims, room)
    served = [claim.priority for claim in claims if given_out.get(claim.job_id)]
    hungry = [claim.priority for claim in claims if given_out.get(claim.job_id, 0) < claim.ready]
    assert not served or not hungry or min(served) >= max(hungry)


@given(claims=claims, room=st.integers(0, 12))
def test_among_equals_nobody_who_gained_is_two_ahead_of_a_hungry_one(claims: list[Claim], room: int) -> None:
    given_out = share_out(claims, room)
    for gained in claims:
        for hungry in claims:
            is_hungry = given_out.get(hungry.job_id, 0) < hungry.ready
            if gained.priority == hungry.priority and given_out.get(gained.job_id) and is_hungry:
                ahead = gained.outstanding + given_out[gained.job_id]
                assert ahead <= hungry.outstanding + given_out.get(hungry.job_id, 0) + 1


@given(
    claims=st.lists(
        st.builds(
            Claim,
            job_id=st.uuids().map(str),
            priority=st.integers(0, 3),
            outstanding=st.integers(0, 5),
            ready=st.integers(0, 5),
            owner_id=st.sampled_from("ab"),
            max_slots=st.none() | st.integers(1, 8),
        ),
        max_size=6,
        unique_by=lambda claim: claim.job_id,
    ),
    room=st.integers(0, 12),
)
def test_no_owner_gets_an_order_beyond_a_limit_and_no_room_is_left_while_somebody_is_below_it(
    claims: list[Claim], room: int
) -> None:
    held = slots_by_owner(claims)
    given_out = share_out(claims, room, held=held)
    after = Counter(held)
    for claim in claims:
        after[claim.owner_id] += given_out.get(claim.job_id, 0)
    for claim in claims:
        most = claim.max_slots
        if given_out.get(claim.job_id) and most is not None:
            mine = [each for each in claims if each.owner_id == claim.owner_id]
            assert after[claim.owner_id] <= max(each.max_slots or after[claim.owner_id] for each in mine)
            assert held[claim.owner_id] < most
    hungry = [claim for claim in claims if given_out.get(claim.job_id, 0) < claim.ready]
    assert sum(given_out.values()) == room or all(is_at_limit(claim, after) for claim in hungry)


def _past_probes(farm: Farm, *job_ids: str) -> list[str]:
    """Get new jobs past their probes, whoever owns them."""
    for order in farm.dispatch():
        assert order.kind is TaskKind.PROBE
        farm.say(claimed(order), done(order))
    farm.plan()
    return [*job_ids]


@pytest.mark.promise("People", "An owner holds no more slots at once than the key allows.")
def test_an_owner_holds_no_more_slots_than_the_key_allows_and_the_others_get_the_rest(farm: Farm) -> None:
    farm.workers = [presence(slots=5)]
    ann = owner("ann", slots=3)
    mine = [farm.submit(caller=ann, frames="1-20", priority=priority) for priority in (90, 80)]
    _past_probes(farm, *mine, other := farm.submit(frames="1-20"))
    orders = farm.dispatch()
    assert Counter(order.job_id for order in orders) == {mine[0]: 3, other: 7}
    of_ann = [order for order in orders if order.job_id == mine[0]]
    farm.say(*map(claimed, orders))
    assert farm.dispatch() == [], "a claimed order holds its slot as well"
    farm.say(done(of_ann[0]), *(done(order) for order in orders if order.job_id == other))
    assert Counter(order.job_id for order in farm.dispatch()) == {mine[0]: 1, other: 7}


def test_orders_that_nobody_may_have_are_not_looked_for_for_ever(farm: Farm) -> None:
    farm.workers = [presence(slots=5)]
    _past_probes(farm, farm.submit(caller=owner("ann", slots=1), frames="1-20"))
    assert [len(farm.dispatch()) for _ in range(2)] == [1, 0]


def test_the_farm_has_a_limit_of_slots_for_every_owner(make_farm: Callable[..., Farm]) -> None:
    farm = make_farm(max_slots=2)
    farm.workers = [presence(slots=5)]
    callers = owner("ann", slots=9), owner("bob")
    jobs = _past_probes(farm, *(farm.submit(caller=caller, frames="1-20") for caller in callers))
    assert Counter(order.job_id for order in farm.dispatch()) == dict.fromkeys(jobs, 2)


def test_the_queue_is_two_orders_a_slot_deep_and_stays_so(farm: Farm) -> None:
    farm.workers = [presence("a", 2), presence("b", 1)]
    farm.planned(frames="1-50")
    orders = farm.dispatch()
    assert len(orders) == 6
    assert farm.dispatch() == []
    farm.say(claimed(orders[0]), done(orders[0]))
    assert len(farm.dispatch()) == 1


def test_orders_of_an_idle_farm_share_the_slots_of_its_only_worker(farm: Farm) -> None:
    farm.workers = [presence(slots=8)]
    farm.planned(frames="1-3", render={"tiles": [1, 1]})
    orders = farm.dispatch()
    assert [order.threads for order in orders] == [3, 3, 3]
    farm.say(*map(claimed, orders), done(orders[0]))
    (assembly,) = farm.dispatch()
    assert assembly.threads == 1, "two frames still render"


@pytest.mark.parametrize("workers", [[presence("a", 4), presence("b", 4)], [presence(slots=1)]])
def test_orders_have_one_thread_where_there_is_nothing_to_share(farm: Farm, workers: list[Presence]) -> None:
    farm.planned(frames="1", render={"tiles": [1, 1]})
    farm.workers = workers
    assert [order.threads for order in farm.dispatch()] == [1]


def test_threads_are_no_way_around_the_slots_of_an_owner(farm: Farm) -> None:
    farm.workers = [presence(slots=8)]
    _past_probes(farm, farm.submit(caller=owner("ann", slots=2), frames="1", render={"tiles": [1, 1]}))
    assert [order.threads for order in farm.dispatch()] == [2]


def test_short_tasks_get_more_orders_but_only_while_there_is_a_worker(farm: Farm) -> None:
    farm.planned(frames="1-50")

    def send(ahead: int) -> int:
        settings, queue = farm.settings, cast(OrderQueue, farm.queue)
        return dispatch(farm.database, queue, farm.workers, now_s=farm.now_s, settings=settings, ahead=ahead)

    assert send(10) == 10
    assert send(10) == send(3) == 0
    farm.workers = []
    assert send(20) == 0


def test_orders_are_sent_ahead_by_the_rate_of_the_last_second() -> None:
    rate = OrderRate()
    assert rate.ahead(at_s=0.0) == 0
    for tenth in range(1, 11):
        rate.record(40, at_s=tenth / 10)
    assert rate.ahead(at_s=1.0) == 200, "0.5 s of 400 orders a second"
    assert rate.ahead(at_s=1.55) == 100
    assert rate.ahead(at_s=9.0) == 0


def test_nothing_goes_out_while_no_worker_is_there(farm: Farm) -> None:
    farm.workers = []
    farm.submit()
    assert farm.dispatch() == []


def test_tasks_of_a_job_go_out_in_frame_order_and_a_frame_is_assembled_before_later_ones(farm: Farm) -> None:
    farm.workers = [presence(slots=1)]
    farm.planned()
    farm.work()
    frames = [order.frame for order in farm.queue.orders if order.kind is TaskKind.ASSEMBLE]
    assert frames == [1, 2, 3]
    assert [order.kind for order in farm.queue.orders].index(TaskKind.ASSEMBLE) < 6


def test_higher_priority_goes_first(farm: Farm) -> None:
    low = farm.planned(priority=10)
    high = farm.submit(priority=90)
    orders = farm.dispatch()
    assert orders[0].job_id == high
    assert {order.job_id for order in orders[1:]} == {low}


def test_jobs_of_one_priority_share_the_slots(farm: Farm) -> None:
    farm.workers = [presence(slots=5)]
    jobs = farm.planned_jobs(2)
    assert Counter(order.job_id for order in farm.dispatch()) == dict.fromkeys(jobs, 5)


def test_a_new_priority_acts_on_the_next_orders(farm: Farm) -> None:
    _, second = farm.planned_jobs(2, frames="1-9")
    with farm.writing() as session:
        prioritise_job(session, second, 99)
    assert {order.job_id for order in farm.dispatch()} == {second}


def test_resting_tasks_of_one_job_do_not_keep_the_slots_from_another(farm: Farm) -> None:
    farm.planned(priority=90, frames="1", outputs=[])
    with farm.writing() as session:
        from sqlalchemy import update

        from service.db.tables import Task

        session.execute(update(Task).where(Task.status == TaskStatus.READY).values(not_before_s=farm.now_s + 9))
    other = farm.submit(priority=1)
    assert [order.job_id for order in farm.dispatch()] == [other]


def test_paused_jobs_get_nothing(farm: Farm) -> None:
    job_id = farm.planned()
    with farm.writing() as session:
        pause_job(session, job_id, now_s=farm.now_s)
    assert farm.dispatch() == []


def test_a_broker_that_takes_nothing_costs_nothing(farm: Farm) -> None:
    job_id = farm.planned()
    farm.queue.error = BrokerUnavailable()
    with pytest.raises(BrokerUnavailable):
        farm.dispatch()
    assert (farm.job(job_id).dispatched, farm.job(job_id).ready) == (0, 6)
    farm.queue.error = None
    assert len(farm.dispatch()) == 4


def test_orders_that_may_have_gone_out_all_the_same_are_told_to_stop(farm: Farm) -> None:
    farm.planned()
    farm.queue.error = BrokerUnavailable()
    with pytest.raises(BrokerUnavailable):
        farm.dispatch()
    with farm.database.reading() as session:
        from service.db.coordinator import pending_stops

        assert len(pending_stops(session)) == 4


def test_an_order_carries_ids_numbers_and_names(farm: Farm) -> None:
    job_id = farm.planned()
    order = farm.dispatch()[1]
    assert order.model_dump(mode="json") == {
        "kind": "render", "job_id": job_id, "task_id": f"{job_id}-2", "attempt": order.attempt, "attempt_number": 1,
        "frame": 1, "tile": {"row": 1, "col": 0}, "output": None, "avoid": [], "digests": {}, "skipped_frames": [],
        "store_id": None, "threads": 1, "requirement": "", "trace": None,
    }  # fmt: skip
