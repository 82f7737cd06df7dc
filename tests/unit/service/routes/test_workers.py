"""Drains of workers over the API."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

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
