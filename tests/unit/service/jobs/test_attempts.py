"""The attempts of the tasks of a job are listed with what became of them, on both databases."""

from __future__ import annotations

from typing import Any

from service.db.attempts import KEPT
from service.db.tables import EndedAttempt
from service.jobs.commands import remove_chunk
from tests.builders_service import Farm, claimed, failed

JOBS = "/api/v1/jobs"


def test_attempts_that_failed_were_lost_or_stopped_are_listed_beside_those_after_them(
    farm: Farm, make_client: Any
) -> None:
    job_id = farm.planned(frames="1", outputs=[])
    client = make_client(farm)
    first, *_ = farm.dispatch()
    farm.now_s += 10
    failure = failed(first, code="render-crashed")
    farm.say(claimed(first), failure, failure)  # the broker may deliver an event twice
    farm.now_s += 3600
    (second, *_) = [order for order in farm.dispatch() if order.task_id == first.task_id]
    farm.say(claimed(second, "w2"))
    client.post(f"{JOBS}/{job_id}/tasks/{first.task_id}/restart").raise_for_status()
    third, *_ = [order for order in farm.dispatch() if order.task_id == first.task_id]
    farm.now_s += 5
    farm.say(claimed(third))
    listed = client.get(f"{JOBS}/{job_id}/attempts").json()
    seen = [
        (item["number"], item["worker"], item["outcome"], item["error_code"], item["ended_at"] is None)
        for item in listed["items"]
        if item["task"] == first.task_id
    ]
    assert seen == [
        (3, "w1", "running", None, True),
        (2, "w2", "stopped", None, False),
        (1, "w1", "failed", "render-crashed", False),
    ]
    assert listed["total"] == 4  # with the probe
    assert client.get(f"{JOBS}/{job_id}/attempts", params={"limit": 1}).json()["total"] == 4
    client.post(f"{JOBS}/{job_id}/cancel").raise_for_status()
    outcomes = [item["outcome"] for item in client.get(f"{JOBS}/{job_id}/attempts").json()["items"]]
    assert outcomes == ["stopped", "stopped", "failed", "done"]
    client.delete(f"{JOBS}/{job_id}").raise_for_status()
    while remove_chunk(farm.database, farm.store, job_id):
        pass
    with farm.database.reading() as session:
        assert session.query(EndedAttempt).all() == []


def test_a_task_that_is_tried_for_days_keeps_its_last_attempts(farm: Farm) -> None:
    job_id = farm.planned(frames="1", outputs=[])
    for _ in range(KEPT + 3):
        first, *_ = farm.dispatch()
        farm.say(claimed(first), failed(first, code="store-full"))
        farm.now_s += 3600
    with farm.database.reading() as session:
        kept = [row.number for row in session.query(EndedAttempt).where(EndedAttempt.sequence == 1)]
    assert sorted(kept) == list(range(4, KEPT + 4)), job_id
