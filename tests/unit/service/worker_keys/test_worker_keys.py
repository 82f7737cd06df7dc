"""Worker keys: made with a join file, listed, revoked; they open nothing, and the registry knows them at once."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from redis import Redis
from redis.backoff import NoBackoff
from redis.exceptions import AuthenticationError, RedisError
from redis.retry import Retry
from sqlalchemy import text

from lippmann.job.messages import wire
from lippmann.job.messages.seals import KeyRefused, Unverifiable
from lippmann.job.messages.worker_keys import WorkerKey
from lippmann.join_file import JoinFile
from service.coordinator.coordinator import REFUSAL_S, Coordinator
from service.db.tables import Credential
from service.doctor.broker import check_broker
from service.doctor.finding import Level
from service.events.wakeup import Wakeup
from service.worker_keys.broker_users import RIGHTS, user_of
from service.worker_keys.registry import KNOWN_S, WorkerKeys
from tests.broker import Broker
from tests.builders_messages import put_presence
from tests.builders_service import Client, Farm, presence
from tests.repository import ROOT
from tests.waiting import until
from worker.report import BrokerClient

PATH = "/api/v1/worker-keys"
GIVEN = {"name": "host 2", "broker_user": "given"}
ONCE = Retry(NoBackoff(), 0)
BUCKET = {"store_url": "s3://farm/lippmann", "s3_endpoint": "https://s3.example"}


@pytest.fixture
def api_farm(make_farm: Callable[..., Farm], monkeypatch: pytest.MonkeyPatch) -> Farm:
    """Lend a farm on a bucket, whose broker is not there."""
    monkeypatch.setenv("AWS_ACCESS_KEY_ID", "AK")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "SK")
    return make_farm(coordinator=False, redis_url="redis://127.0.0.1:1/0", **BUCKET)


def made(api: Client, **changes: Any) -> JoinFile:
    answer = api.post(PATH, json=GIVEN | changes)
    assert answer.status_code == 201, answer.text
    return JoinFile.model_validate(answer.json()["join"])


def test_a_worker_key_comes_with_everything_that_a_worker_needs(api: Client, api_farm: Farm) -> None:
    join = made(api, expires_in_days=2, pool="night", tags=["big"])
    assert (join.worker.pool, join.worker.tags) == ("night", ("big",))
    assert api.post(PATH, json=GIVEN | {"tags": ["A B"]}).status_code == 422
    assert join.worker.expires_at == datetime.fromtimestamp(api_farm.now_s + 2 * 86_400, UTC)
    assert [key.hex() for key in api_farm.settings.order_keys.keys()] == list(join.order_keys)  # noqa: SIM118
    assert join.broker.model_dump() == {"url": "redis://127.0.0.1:1/0", "user": "", "password": "", "ca": ""}
    assert (join.store.url, join.store.endpoint) == (BUCKET["store_url"], BUCKET["s3_endpoint"])
    assert (join.store.access_key, join.store.secret_key) == ("AK", "SK")
    (listed,) = api.get(PATH).json()["items"]
    assert (listed["id"], listed["name"], listed["used_at"]) == (join.worker.id, "host 2", None)
    assert join.worker.secret not in api.get(PATH).text
    assert join.worker.id not in api.get("/api/v1/keys").text
    with api_farm.database.reading() as session:
        assert join.worker.secret not in str(vars(session.get_one(Credential, join.worker.id)))
    assert [entry["action"] for entry in api.get("/api/v1/audit").json()["items"]] == ["create-worker-key"]


@pytest.mark.promise("People", "A worker key opens nothing in the API.")
def test_a_worker_key_opens_nothing_in_the_api(api: Client) -> None:
    join = made(api)
    for key in (f"lip_{join.worker.id}_{join.worker.secret}", join.worker.secret):
        answer = api.get("/api/v1/workers", headers={"Authorization": f"Bearer {key}"})
        assert answer.status_code == 401
        assert api.post("/login", data={"key": key}, follow_redirects=False).status_code in (401, 403)


def test_a_registry_knows_a_new_key_and_refuses_a_revoked_and_an_expired_one(api: Client, api_farm: Farm) -> None:
    steady, used = [0.0], []
    registry = WorkerKeys(
        api_farm.database, clock=lambda: api_farm.now_s, steady=lambda: steady[0],
        note_use=lambda key_id, now_s: used.append(key_id),
    )  # fmt: skip
    with pytest.raises(KeyRefused, match="none of this farm"):
        registry.message_key("0" * 12)
    steady[0] += 0.3
    join, other = made(api, expires_in_days=1), made(api)
    right = WorkerKey.of_secret(join.worker.id, join.worker.secret).message_key
    assert registry.message_key(join.worker.id) == right
    assert used == [join.worker.id]
    api_farm.now_s += 86_401
    with pytest.raises(KeyRefused, match=f"{join.worker.id} has expired"):
        registry.message_key(join.worker.id)
    assert api.delete(f"/api/v1/keys/{other.worker.id}").status_code == 204
    assert api.delete(f"/api/v1/keys/{other.worker.id}").status_code == 404
    steady[0] += KNOWN_S + 0.1
    with pytest.raises(KeyRefused, match="was revoked"):
        registry.message_key(other.worker.id)


def test_while_the_database_is_away_the_known_keys_count(api: Client, api_farm: Farm) -> None:
    steady = [0.0]
    registry = WorkerKeys(api_farm.database, clock=lambda: api_farm.now_s, steady=lambda: steady[0])
    join = made(api)
    known = registry.message_key(join.worker.id)
    with api_farm.writing() as session:
        session.execute(text("ALTER TABLE credentials RENAME TO gone"))
    steady[0] += 60
    assert registry.message_key(join.worker.id) == known
    # A key that may be valid is not refused for good, or all workers would end while the database is away.
    for unknown in (registry, WorkerKeys(api_farm.database)):
        with pytest.raises(Unverifiable, match="the database does not answer"):
            unknown.message_key("0" * 12)


def test_a_worker_without_a_key_is_refused_only_where_keys_are_needed(api_farm: Farm) -> None:
    assert WorkerKeys(api_farm.database).message_key(None) == b""
    with pytest.raises(KeyRefused, match="LIPPMANN_WORKERS_NEED_KEYS"):
        WorkerKeys(api_farm.database, needed=True).message_key(None)


def test_expired_worker_keys_stay_listed_until_they_are_revoked(api: Client, api_farm: Farm) -> None:
    from service.db.access import delete_expired

    made(api, expires_in_days=1)
    with api_farm.writing() as session:
        delete_expired(session, now_s=api_farm.now_s + 10 * 86_400, idle_s=1, idempotency_s=1, audit_s=1)
    assert len(api.get(PATH).json()["items"]) == 1


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"redis_url": "unix:///run/b.sock", **BUCKET}, "LIPPMANN_REDIS_URL: expected a broker that other machines"),
        ({"redis_url": "redis://127.0.0.1:1/0"}, "LIPPMANN_STORE_URL: expected a bucket"),
        ({"redis_url": "redis://127.0.0.1:1/0?x=1", **BUCKET}, "LIPPMANN_REDIS_URL: expected a URL without options"),
    ],
)
def test_a_farm_of_one_machine_makes_no_join_files_and_says_why(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client], settings: dict[str, str], named: str
) -> None:
    api = make_client(make_farm(coordinator=False, **settings))
    answer = api.post(PATH, json=GIVEN)
    assert (answer.status_code, named in answer.text) == (422, True), answer.text
    assert api.get(PATH).json()["items"] == []


def test_a_key_with_an_own_user_needs_the_broker(api: Client) -> None:
    answer = api.post(PATH, json={"name": "x"})
    assert (answer.status_code, answer.json()["code"]) == (503, "broker-unavailable")
    assert api.get(PATH).json()["items"] == []


def test_the_rights_of_own_users_are_the_documented_ones_of_workers() -> None:
    (rights,) = re.findall(r"^user lippmann-worker on #\w+ (.*)$", (ROOT / "deploy/broker-users.acl").read_text(), re.M)
    assert rights == RIGHTS


@pytest.fixture
def broker(tmp_path: Path) -> Any:
    broker = Broker(tmp_path)
    yield broker
    broker.kill()


def test_a_broker_makes_a_user_for_a_key_gets_it_again_when_lost_and_ends_its_connections(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client], broker: Broker
) -> None:
    farm = make_farm(coordinator=False, redis_url=broker.url, **BUCKET)
    api = make_client(farm)
    join = made(api, broker_user="own")
    assert join.broker.user == user_of(join.worker.id)
    key = WorkerKey.of_secret(join.worker.id, join.worker.secret)
    assert join.broker.password == key.broker_password
    users = api.app.state.lippmann.broker_users  # type: ignore[attr-defined]
    broker.client.execute_command("ACL", "DELUSER", join.broker.user)
    users._checked_s = float("-inf")
    users.reconcile(farm.database, now_s=farm.now_s)

    def as_worker() -> Any:
        return Redis(port=broker.port, username=join.broker.user, password=join.broker.password, retry=ONCE)

    with as_worker() as worker:
        assert worker.set("lippmann:lease:a", "mine")
        assert api.delete(f"/api/v1/keys/{join.worker.id}").status_code == 204
        with pytest.raises(RedisError):
            worker.get("lippmann:lease:a")
    with as_worker() as worker, pytest.raises(AuthenticationError):
        worker.ping()
    with farm.database.reading() as session:
        assert session.get(Credential, join.worker.id) is None


def test_a_worker_whose_key_was_revoked_is_shown_with_the_reason_and_told(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client], broker: Broker
) -> None:
    farm = make_farm(coordinator=False, redis_url=broker.url, **BUCKET)
    api, seals = make_client(farm), farm.settings.seals
    join = made(api)
    key = WorkerKey.of_secret(join.worker.id, join.worker.secret)
    present = presence("w1", slots=4).model_copy(update={"instance": key.instance("f"), "worker_key": key.id})
    put_presence(broker.client, present, replace(seals, worker_key=key))
    client = BrokerClient(broker.url, "w1", present.instance, seals=replace(seals, worker_key=key))
    coordinator = Coordinator(farm.database, farm.parts.store, farm.settings, Wakeup(), clock=lambda: farm.now_s)
    assert [worker.slots for worker in coordinator._present()] == [4]
    assert not client.is_key_refused(key.id)
    assert api.delete(f"/api/v1/keys/{key.id}").status_code == 204
    farm.now_s += 10
    until(lambda: [worker["slots"] for worker in api.get("/api/v1/workers").json()["items"]] == [0])
    (shown,) = api.get("/api/v1/workers").json()["items"]
    assert f"its worker key {key.id} was revoked" in shown["fault"]
    faults = [one["message"] for one in api.get("/api/v1/health").json()["faults"]]
    assert any(f"w1: its worker key {key.id} was" in message for message in faults)

    def is_told() -> bool:
        farm.now_s += 2
        coordinator._present()
        return client.is_key_refused(key.id)

    until(is_told)
    told = broker.client.ttl(wire.stop_key(f"worker-key-{key.id}"))
    assert 0 < told <= REFUSAL_S, "a leader whose clock was wrong shuts nobody out for long"
    warned = [one for one in check_broker(farm.settings, farm.database) if "refused" in one.message]
    broker.client.delete(wire.presence_key("w1"))
    noted = [one for one in check_broker(farm.settings, farm.database) if "refused" in one.message]
    coordinator.stop()
    assert [one.level for one in (*warned, *noted)] == [Level.WARNING, Level.NOTE]
    assert f"worker w1 on h is refused: its worker key {key.id} was revoked" in warned[0].message
    assert key.id in noted[0].message


def test_workers_without_a_key_are_told_where_keys_are_needed(make_farm: Callable[..., Farm], broker: Broker) -> None:
    farm = make_farm(redis_url=broker.url, workers_need_keys=True)
    farm.settings.order_keys.ensure()
    put_presence(broker.client, presence("w1"), farm.settings.seals)
    coordinator = Coordinator(farm.database, farm.parts.store, farm.settings, Wakeup(), clock=lambda: farm.now_s)
    client = BrokerClient(broker.url, "w1", seals=farm.settings.seals)
    assert not client.is_key_refused(None)
    (found,) = coordinator._present()
    coordinator.stop()
    assert (found.slots, client.is_key_refused(None)) == (0, True)
    assert 0 < broker.client.ttl(wire.stop_key("worker-key-none")) <= REFUSAL_S


def test_a_service_that_may_make_no_users_says_which_rights_it_lacks(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client], broker: Broker
) -> None:
    rights = re.findall(r"^user lippmann-service on #\w+ (.*)$", (ROOT / "deploy/broker-users.acl").read_text(), re.M)
    broker.client.execute_command("ACL", "SETUSER", "lippmann-service", "on", ">word", *rights[0].split())
    url = broker.url.replace("redis://", "redis://lippmann-service:word@")
    api = make_client(make_farm(coordinator=False, redis_url=url, **BUCKET))
    answer = api.post(PATH, json={"name": "x"})
    assert answer.status_code == 422
    assert "+acl|setuser" in answer.text
    assert api.get(PATH).json()["items"] == []
    assert made(api).broker.model_dump(exclude={"url"}) == {"user": "", "password": "", "ca": ""}
    broker.client.execute_command("ACL", "SETUSER", "lippmann-service", "+acl|setuser", "+acl|deluser", "+acl|users")
    assert made(api, broker_user="own").broker.user.startswith("lippmann-worker-")
