"""What clients receive of a frame."""

from __future__ import annotations

from service.db.tables import JobEvent
from service.schemas.events import EventTopic
from tests.builders_service import Farm, claimed, done, failed


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
