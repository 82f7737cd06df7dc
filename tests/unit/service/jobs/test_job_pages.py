"""A list of jobs is searched, filtered, sorted and read in pages, on both databases."""

from __future__ import annotations

from typing import Any

import pytest
from sqlalchemy import update

from lippmann.job.states import JobStatus
from service.db.tables import Job
from service.schemas.job import JobSort
from tests.builders_service import CALLER, Client, Farm, claimed, done, owner

JOBS = "/api/v1/jobs"


@pytest.fixture
def shelf(api_farm: Farm) -> list[str]:
    """Submit five jobs that differ in everything by which a list can be sorted; return their ids, oldest first."""
    made: list[str] = []
    rows: list[dict[str, Any]] = [
        {"title": "Pond", "status": JobStatus.DONE, "priority": 50, "cpu_s": 7.5},
        {"title": "pond 100%", "status": JobStatus.RUNNING, "priority": 80, "cpu_s": 2.0, "running": 2, "wall_s": 10.0,
         "total_px": 100, "done_px": 50},
        {"title": "", "status": JobStatus.FAILED, "priority": 50, "cpu_s": 0.1},
        {"title": "Aquarium", "status": JobStatus.RUNNING, "priority": 10, "cpu_s": 9.0, "running": 1, "wall_s": 10.0,
         "total_px": 100, "done_px": 90, "frames_total": 9},
        {"title": "zoo", "status": JobStatus.QUEUED, "priority": 0, "cpu_s": 0.0},
    ]  # fmt: skip
    for number, row in enumerate(rows):
        api_farm.now_s += 1
        made.append(api_farm.submit(caller=owner("ann") if number % 2 else CALLER))
        with api_farm.writing() as session:
            session.execute(update(Job).where(Job.id == made[-1]).values(**row))
    return made


def _ids(api: Client, **params: Any) -> list[str]:
    answer = api.get(JOBS, params=params)
    assert answer.status_code == 200, answer.text
    return [job["id"] for job in answer.json()["items"]]


ORDERS = {
    JobSort.CREATED: [0, 1, 2, 3, 4],
    JobSort.NAME: [3, 2, 0, 1, 4],  # the third has the name of its scene, ball
    JobSort.OWNER: [1, 3, 0, 2, 4],
    JobSort.STATUS: [4, 1, 3, 0, 2],
    JobSort.PRIORITY: [4, 3, 0, 2, 1],
    JobSort.WORK: [1, 3, 4, 0, 2],
    JobSort.FRAMES: [0, 1, 2, 4, 3],
    JobSort.PROGRESS: [2, 4, 1, 3, 0],
    JobSort.TIME_LEFT: [3, 1, 0, 2, 4],
    JobSort.COST: [4, 2, 1, 0, 3],
}


LONGEST_FIRST = [1, 3, 4, 2, 0]
"""Jobs without an estimate come last by the time left, in both directions."""


def test_jobs_are_sorted_in_both_directions_and_pages_lead_through_all_of_them_once(
    api: Client, shelf: list[str]
) -> None:
    for sort in JobSort:
        for ascending in (True, False):
            order = ORDERS[sort] if ascending else ORDERS[sort][::-1]
            if sort is JobSort.TIME_LEFT and not ascending:
                order = LONGEST_FIRST
            wanted = {"sort": sort.value, "ascending": ascending, "limit": 2}
            seen, cursor = list[str](), None
            while len(seen) < 9:
                page = api.get(JOBS, params=wanted | ({"cursor": cursor} if cursor else {})).json()
                seen += [job["id"] for job in page["items"]]
                cursor = page["next_cursor"]
                if cursor is None:
                    break
            assert seen == [shelf[number] for number in order], (sort, ascending)
            assert _ids(api, **wanted, offset=3) == seen[3:5]


def test_jobs_are_filtered_by_status_owner_and_text_and_counted(api: Client, shelf: list[str]) -> None:
    assert _ids(api, status=["queued", "failed"]) == [shelf[4], shelf[2]]
    assert _ids(api, owner="ann") == [shelf[3], shelf[1]]
    assert _ids(api, search="POND") == [shelf[1], shelf[0]]
    assert _ids(api, search="0%") == [shelf[1]]
    assert _ids(api, search="_") == []
    assert _ids(api, search=shelf[2][-5:]) == [shelf[2]]
    assert _ids(api, search="pond", owner="ann", status="running") == [shelf[1]]
    assert api.get(JOBS, params={"status": "running", "limit": 1, "count": True}).json()["total"] == 2
    assert api.get(JOBS, params={"limit": 1}).json()["total"] is None


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"sort": "colour"}, "sort"),
    ({"status": "asleep"}, "status"),
    ({"offset": -1}, "offset"),
    ({"search": ""}, "search"),
    ({"search": "x" * 101}, "search"),
    ({"sort": "cost", "cursor": "01h"}, "cursor"),
    ({"sort": "cost", "cursor": "01h~nan"}, "cursor"),
    ({"cursor": "01h~3"}, "cursor"),
    ({"cursor": "01h", "offset": 3}, "cursor"),
]


def test_a_wrong_parameter_is_named(api: Client) -> None:
    for params, field in WRONG:
        answer = api.get(JOBS, params=params)
        assert answer.status_code == 422, answer.text
        assert field in str(answer.json()["errors"])


def test_a_text_that_no_database_can_store_is_a_problem(api: Client) -> None:
    assert api.get(JOBS, params={"search": "a\0b"}).status_code in (200, 422)


def test_a_job_has_the_thumbnail_of_its_newest_frame_and_the_size_of_its_files(farm: Farm, make_client: Any) -> None:
    job_id = farm.planned(frames="1-3", render={"tiles": [1, 1]}, outputs=[])
    client = make_client(farm)
    assert client.get(f"{JOBS}/{job_id}").json()["poster"] is None
    farm.work(rounds=2)
    frames = client.get(f"{JOBS}/{job_id}/frames").json()["items"]
    newest = max(frame["frame"] for frame in frames if frame["status"] == "done")
    assert client.get(f"{JOBS}/{job_id}").json()["poster"] == frames[newest - 1]["thumb"]
    farm.work()
    newest_of_all = client.get(f"{JOBS}/{job_id}/frames").json()["items"][2]["thumb"]
    assert client.get(JOBS).json()["items"][0]["poster"] == newest_of_all is not None


def test_the_statuses_of_all_frames_are_runs(farm: Farm, make_client: Any) -> None:
    job_id = farm.planned(frames="1-9:2, 20", outputs=[])
    client = make_client(farm)
    path = f"{JOBS}/{job_id}/frames/statuses"
    whole = [
        {"status": "waiting", "first": 1, "last": 9, "step": 2},
        {"status": "waiting", "first": 20, "last": 20, "step": 1},
    ]
    assert client.get(path).json() == {"runs": whole}
    farm.say(*map(claimed, farm.dispatch()))
    runs = client.get(path).json()["runs"]
    assert runs[0] == {"status": "rendering", "first": 1, "last": 1, "step": 1}
    frames = client.get(f"{JOBS}/{job_id}/frames").json()["items"]
    spread = [(n, run["status"]) for run in runs for n in range(run["first"], run["last"] + 1, run["step"])]
    assert spread == [(frame["frame"], frame["status"]) for frame in frames]


def test_attempts_come_with_their_workers_and_times_the_latest_first(farm: Farm, make_client: Any) -> None:
    job_id = farm.planned(frames="1-2", outputs=[])
    client = make_client(farm)
    first, second, *_ = farm.dispatch()
    farm.now_s += 10
    farm.say(claimed(first), done(first))
    farm.now_s += 10
    farm.say(claimed(second, "w2"))
    page = client.get(f"{JOBS}/{job_id}/attempts", params={"limit": 2}).json()
    assert [(item["task"], item["worker"], item["status"]) for item in page["items"]] == [
        (second.task_id, "w2", "running"),
        (first.task_id, "w1", "done"),
    ]
    assert page["items"][0]["ended_at"] is None
    assert page["items"][1]["ended_at"] is not None
    assert page["total"] == 3  # with the probe


def test_the_tasks_of_a_frame_are_listed(farm: Farm, make_client: Any) -> None:
    job_id = farm.planned(frames="1-3", outputs=[])
    tasks = make_client(farm).get(f"{JOBS}/{job_id}/tasks", params={"frame": 2}).json()["items"]
    assert [(task["kind"], task["frame"]) for task in tasks] == [("render", 2), ("render", 2), ("assemble", 2)]
