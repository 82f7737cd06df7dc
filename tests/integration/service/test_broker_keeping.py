"""A broker that removes orders when its memory is full, and one that forgets them in a restart."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from lippmann.job.messages.events import Event
from lippmann.job.messages.orders import Order, TaskKind
from service.broker_stream import BrokerKeeping, Stream
from service.db.engine import Database
from service.db.migrations import migrate
from service.doctor.broker import check_broker, check_broker_of_worker
from service.doctor.finding import Check, Finding, Level
from service.health import NOT_KEPT
from service.settings import Settings
from tests.broker import Broker
from tests.builders_messages import SEALS
from tests.builders_service import SPEC, claimed, done
from tests.integration.service.conftest import FakeWorker, Service
from tests.waiting import ENOUGH_S, until
from worker.settings import WorkerSettings


def keeping_of(broker: Broker) -> BrokerKeeping | None:
    stream = Stream(broker.url, seals=SEALS, timeout_s=ENOUGH_S)
    try:
        return stream.keeping()
    finally:
        stream.close()


def findings(url: str, tmp_path: Path) -> list[Finding]:
    database = Database(f"sqlite:///{tmp_path}/doctor.db")
    migrate(database)
    found = [*check_broker(Settings(redis_url=url, data_dir=tmp_path), database)]
    database.dispose()
    return [finding for finding in found if finding.check is Check.BROKER]


def test_a_broker_that_removes_orders_pauses_jobs_with_the_reason_until_it_keeps_them(
    make_service: Callable[..., Service], make_worker: Callable[..., FakeWorker], broker: Broker, tmp_path: Path
) -> None:
    service = make_service(store_check_s=0.3)

    def answer(order: Order) -> list[Event]:
        return [claimed(order), done(order)] if order.kind is TaskKind.PROBE else [claimed(order)]

    make_worker(answer)
    job_id = str(service.client.post("/jobs", json=SPEC).json()["id"])
    until(lambda: service.status(job_id) == "running")
    # Without a limit of memory, no policy removes anything.
    broker.client.config_set("maxmemory-policy", "allkeys-lru")
    assert keeping_of(broker) == BrokerKeeping(None, has_append_only_file=False)
    broker.client.config_set("maxmemory", "64mb")
    until(lambda: service.status(job_id) == "paused")
    health: dict[str, Any] = service.client.get("/health").json()
    said = "expected maxmemory-policy noeviction, got allkeys-lru"
    assert (health["status"], health["broker"]["ok"], said in health["broker"]["detail"]) == ("degraded", False, True)
    assert [fault["code"] for fault in health["faults"]] == ["broker-evicts"]
    assert said in service.client.get(f"/jobs/{job_id}").json()["pause"]["reason"]
    found = findings(broker.url, tmp_path)
    assert [(one.level, said in one.message) for one in found] == [(Level.ERROR, True), (Level.WARNING, False)]
    broker.client.config_set("maxmemory-policy", "noeviction")
    until(lambda: service.status(job_id) == "running")
    until(lambda: service.client.get("/health").json()["broker"] == {"ok": True, "detail": NOT_KEPT})


def test_a_broker_without_an_append_only_file_is_a_warning_and_one_with_it_is_none(
    broker: Broker, tmp_path: Path
) -> None:
    (warning,) = findings(broker.url, tmp_path)
    assert (warning.level, "expected appendonly yes, got no" in warning.message) == (Level.WARNING, True)
    broker.client.config_set("appendonly", "yes")
    assert findings(broker.url, tmp_path) == []
    assert keeping_of(broker) == BrokerKeeping(None, has_append_only_file=True)


def test_who_may_not_ask_how_the_broker_keeps_orders_is_told_so(broker: Broker, tmp_path: Path) -> None:
    broker.client.execute_command("ACL", "SETUSER", "default", "-info")
    try:
        (note,) = findings(broker.url, tmp_path)
        assert (note.level, "no right to INFO" in note.message) == (Level.NOTE, True)
        worker = WorkerSettings(redis_url=broker.url, data_dir=tmp_path)
        assert [*check_broker_of_worker(worker)] == []
    finally:
        broker.client.execute_command("ACL", "SETUSER", "default", "+info")


def test_a_wrong_password_of_a_worker_is_an_error(broker: Broker, tmp_path: Path) -> None:
    url = broker.url.replace("redis://", "redis://lippmann-worker:wrong@")
    (error,) = check_broker_of_worker(WorkerSettings(redis_url=url, data_dir=tmp_path))
    assert (error.level, "invalid username-password" in error.message) == (Level.ERROR, True)
