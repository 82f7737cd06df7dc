"""Workers of other releases are named, and the directions tell workers the release of the service."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from lippmann.job.messages import wire
from lippmann.job.messages.protocol import PROTOCOL
from service.doctor.broker import check_broker
from service.doctor.finding import Check, Level
from service.health import package_version
from service.settings import Settings
from tests.broker import Broker
from tests.builders_messages import put_presence, seals_in
from tests.builders_service import SPEC, presence
from tests.integration.service.conftest import Service
from tests.waiting import until
from worker.report import BrokerClient


def test_workers_of_other_releases_are_named_and_get_no_orders_if_messages_mean_something_else(
    make_service: Callable[..., Service], broker: Broker, tmp_path: Path
) -> None:
    service = make_service()
    seals = seals_in(tmp_path)
    older = presence("older").model_copy(update={"version": "0.0.9"})
    newer = presence("newer", 5).model_copy(
        update={"version": "9.0.0", "protocol": PROTOCOL + 2, "oldest_protocol": PROTOCOL + 1}
    )
    same = presence("same").model_copy(update={"version": package_version()})
    for worker in (older, newer, same):
        put_presence(broker.client, worker, seals, ex=600)
    notes = [
        f"newer runs Lippmann 9.0.0 (messages {PROTOCOL + 2}), this service {package_version()} (messages {PROTOCOL}): "
        "they do not understand each other, so it gets no orders.",
        f"older runs Lippmann 0.0.9, this service {package_version()}: upgrade the older one.",
    ]
    health = until(lambda: (seen := service.client.get("/health").json())["faults"] and seen)
    assert (health["status"], health["slots"], health["notes"]) == ("degraded", 4, notes)
    assert [(fault["code"], fault["message"]) for fault in health["faults"]] == [("worker-version", notes[0])]
    assert service.client.get("/health", headers={"Authorization": ""}).json()["notes"] == []
    workers = service.client.get("/workers").json()["items"]
    assert [worker["version_note"] for worker in workers] == [*notes, None]

    settings = Settings(redis_url=broker.url, data_dir=tmp_path)
    found = [
        (each.check, each.level, each.message)
        for each in check_broker(settings, service.state.database)
        if each.check is Check.WORKERS
    ]
    assert found == [(Check.WORKERS, Level.WARNING, notes[0]), (Check.WORKERS, Level.NOTE, notes[1])]


def test_the_directions_name_the_requirements_of_open_jobs_and_the_release(
    service: Service, broker: Broker, tmp_path: Path
) -> None:
    client = BrokerClient(broker.url, "w1", "i1", seals=seals_in(tmp_path))
    directions = until(client.directions)
    assert (directions.release, directions.protocol, directions.requirements) == (package_version(), PROTOCOL, ())
    answer = service.client.post("/jobs", json=SPEC | {"workers": {"tags": ["gpu"]}})
    requirement = '{"tags":["gpu"]}'
    until(lambda: (seen := client.directions()) and seen.requirements == (requirement,))
    queue = wire.CARRIER_PREFIX + wire.queue_of(requirement)
    broker.client.lpush(queue, "an order of an attempt that is over")
    service.client.post(f"/jobs/{answer.json()['id']}/cancel")
    until(lambda: not broker.client.exists(queue))
    assert client.directions() == directions
    broker.client.set(wire.DIRECTIONS, directions.model_dump_json())
    assert client.directions() in (None, directions), "what is not signed is refused"
