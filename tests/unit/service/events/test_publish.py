"""What listeners hear of a frame, and for how long they may."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from service.auth import caller_of_key, create_key, is_valid, revoke_key
from service.db.tables import JobEvent
from service.events.sse import stream_events
from service.events.wakeup import Wakeup
from service.schemas.access import Role
from service.schemas.events import EventTopic
from tests.builders_service import Farm, claimed, done, failed
from tests.waiting import ENOUGH_S


def _frames_heard(farm: Farm, job_id: str) -> list[tuple[int, str]]:
    with farm.database.reading() as session:
        rows = session.query(JobEvent).filter(JobEvent.job_id == job_id, JobEvent.topic == EventTopic.FRAME)
        return [(row.data["frame"], row.data["status"]) for row in rows.order_by(JobEvent.id)]


def test_a_frame_whose_only_running_tile_goes_back_waits_again(farm: Farm) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    farm.say(failed(order))
    assert _frames_heard(farm, job_id) == [(1, "rendering"), (1, "waiting")]


def test_a_frame_whose_tile_begins_and_goes_back_in_one_batch_does_not_change(farm: Farm) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order), failed(order))
    assert _frames_heard(farm, job_id) == []


def test_a_frame_with_a_tile_that_is_done_goes_on_when_another_goes_back(farm: Farm) -> None:
    job_id = farm.planned()
    first, second, *_ = farm.dispatch()
    farm.say(claimed(first), done(first), claimed(second))
    farm.say(failed(second))
    assert _frames_heard(farm, job_id)[-1] == (1, "rendering")
    assert set(_frames_heard(farm, job_id)) == {(1, "rendering")}


def _hear(farm: Farm, is_authorized: Callable[[], bool]) -> list[bytes]:
    async def hear() -> list[bytes]:
        wakeup = Wakeup()
        stream = stream_events(
            farm.database, wakeup, job_id=None, position=0, keepalive_s=0.05, is_authorized=is_authorized
        )
        async with asyncio.timeout(ENOUGH_S):
            return [piece async for piece in stream]

    return asyncio.run(hear())


def test_a_stream_ends_when_its_listener_may_no_longer_listen(farm: Farm) -> None:
    asked = iter([True, True, False])
    assert b": alive\n\n" in _hear(farm, lambda: next(asked))


def test_a_stream_with_much_to_say_ends_as_well(farm: Farm) -> None:
    farm.submit()
    asked = iter([True, True, False])

    def is_authorized() -> bool:
        farm.submit()
        return next(asked)

    assert any(b"event: job" in piece for piece in _hear(farm, is_authorized))


def test_a_caller_is_valid_until_the_key_is_revoked(farm: Farm) -> None:
    with farm.writing() as session:
        key_id, key = create_key(session, "lab", Role.VIEWER)
        caller = caller_of_key(session, key, now_s=farm.now_s)
        assert caller is not None
        assert is_valid(session, caller, now_s=farm.now_s)
        revoke_key(session, key_id)
        assert not is_valid(session, caller, now_s=farm.now_s)
