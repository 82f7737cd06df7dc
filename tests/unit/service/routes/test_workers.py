"""Drains, exclusions and pardons of workers over the API."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from service.db.faults import avoiding
from service.db.tables import WorkerFault
from tests.broker import Broker
from tests.builders_messages import put_presence
from tests.builders_service import Client, Farm, presence
from tests.waiting import until


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Broker]:
    broker = Broker(tmp_path)
    yield broker
    broker.kill()


def test_a_worker_whose_instance_does_not_fit_is_not_drained(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client], broker: Broker
) -> None:
    farm = make_farm(coordinator=False, redis_url=broker.url)
    farm.settings.order_keys.ensure()
    api = make_client(farm)
    for name, instance in (("fits", 64 * "a"), ("long", 65 * "a")):
        put_presence(broker.client, presence(name).model_copy(update={"instance": instance}), farm.settings.seals)
    until(lambda: len(api.get("/api/v1/workers").json()["items"]) == 2)
    assert api.put("/api/v1/workers/fits/drain").status_code == 204
    answer = api.put("/api/v1/workers/long/drain")
    assert answer.status_code == 404
    assert "an instance of more than 64 characters" in answer.text


def test_an_excluded_worker_is_named_also_when_it_is_gone_until_it_is_included(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client], broker: Broker
) -> None:
    farm = make_farm(coordinator=False, redis_url=broker.url)
    farm.settings.order_keys.ensure()
    api = make_client(farm)
    put_presence(broker.client, presence("w1").model_copy(update={"instance": "first"}), farm.settings.seals)
    until(lambda: api.get("/api/v1/workers").json()["items"])
    assert api.put("/api/v1/workers/w1/exclusion").status_code == 204
    answer = api.get("/api/v1/workers").json()
    assert [(one["excluded"], one["drained"]) for one in answer["items"]] == [(True, False)]
    broker.client.flushall()
    answer = api.get("/api/v1/workers").json()
    assert [(one["worker"], one["name"]) for one in answer["excluded"]] == [("w1", "tester")]
    assert api.delete("/api/v1/workers/w1/exclusion").status_code == 204
    assert api.delete("/api/v1/workers/w1/exclusion").status_code == 404


def test_a_worker_is_forgiven_by_all_jobs(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.submit()
    with api_farm.writing() as session:
        session.add(WorkerFault(job_id=job_id, worker="w1", failures=3, avoided_until_s=api_farm.now_s + 60))
    with api_farm.database.reading() as session:
        assert avoiding(session, now_s=api_farm.now_s) == {"w1": 1}
    assert api.delete("/api/v1/workers/w1/faults").status_code == 204
    with api_farm.database.reading() as session:
        assert avoiding(session, now_s=api_farm.now_s) == {}
    answer = api.delete("/api/v1/workers/w1/faults")
    assert (answer.status_code, answer.json()["detail"]) == (404, "no job has a failure of the worker 'w1'")
