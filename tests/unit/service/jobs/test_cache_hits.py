"""Tiles from the render cache are counted, once each, and no longer when they are made again."""

from __future__ import annotations

from lippmann.job.messages.events import Event, EventKind
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.plan import artifact_names as names
from service.db.tables import JobEvent
from service.ids import task_id
from service.jobs.artifact_repair import repair_artifact
from service.schemas.events import EventTopic
from tests.builders_service import PROBE, Client, Farm, claimed, done, event

JOBS = "/api/v1/jobs"


def cached(order: Order) -> Event:
    return event(order, EventKind.DONE, cpu_s=0.1, wall_s=0.2, cached=True)


def hits(farm: Farm, job_id: str) -> tuple[int, int]:
    job = farm.job(job_id)
    return job.cache_hits, job.cached_px


def test_a_tile_from_the_cache_counts_once_with_its_pixels(farm: Farm) -> None:
    job_id = farm.planned()
    first, second, *_ = farm.dispatch()
    farm.say(claimed(first), cached(first), cached(first), claimed(second), done(second))
    assert hits(farm, job_id) == (1, farm.task(first).weight_px)
    assert (farm.task(first).cached, farm.task(second).cached) == (True, False)


def test_the_api_shows_hits_with_jobs_tasks_and_progress(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.planned()
    first, second, *_ = api_farm.dispatch()
    api_farm.say(claimed(first), cached(first), claimed(second), done(second))
    assert api.get(f"{JOBS}/{job_id}").json()["cache_hits"] == 1
    tasks = {task["id"]: task["cached"] for task in api.get(f"{JOBS}/{job_id}/tasks").json()["items"]}
    assert {each for each, is_cached in tasks.items() if is_cached} == {first.task_id}
    with api_farm.database.reading() as session:
        told = [row.data for row in session.query(JobEvent).filter(JobEvent.topic == EventTopic.PROGRESS)]
    assert told[-1]["cache_hits"] == 1


def test_a_tile_that_is_made_again_is_a_hit_no_longer(farm: Farm) -> None:
    job_id = farm.planned(frames="1", render={"tiles": [1, 1]})
    (render,) = farm.dispatch()
    tile = names.job_artifact(job_id, farm.task(render).artifact)
    farm.store.files[tile] = b"whole"
    farm.say(claimed(render), cached(render))
    assert hits(farm, job_id)[0] == 1
    del farm.store.files[tile]
    assert repair_artifact(farm.database, farm.store, job_id, farm.task(render).artifact)
    assert hits(farm, job_id) == (0, 0)
    again = next(order for order in farm.dispatch() if order.task_id == render.task_id)
    assert again.attempt_number == 2
    farm.say(claimed(again), done(again))
    assert (hits(farm, job_id), farm.task(again).cached) == ((0, 0), False)


def test_only_tiles_are_hits_and_a_worker_that_says_nothing_has_none(farm: Farm) -> None:
    job_id = farm.submit()
    (probe,) = farm.dispatch()
    assert (probe.kind, probe.task_id) == (TaskKind.PROBE, task_id(job_id, 0))
    farm.say(claimed(probe), event(probe, EventKind.DONE, probe=PROBE, cached=True))
    farm.plan()
    farm.work()
    assert hits(farm, job_id) == (0, 0)
    assert {task.cached for task in farm.tasks(job_id)} == {False}
