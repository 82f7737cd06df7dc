"""The users of worker keys at the broker: those of keys that are not valid go, and nobody waits for a silent broker."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from lippmann.errors import BadInput
from lippmann.job.messages.worker_keys import WorkerKey
from service.db import access as access_rows
from service.db.tables import Credential
from service.errors import BrokerUnavailable
from service.worker_keys import broker_users
from service.worker_keys.broker_users import BrokerUsers, user_of
from service.worker_keys.joining import _broker
from tests.broker import Broker
from tests.builders_service import Client, Farm

PATH = "/api/v1/worker-keys"
BUCKET = {"store_url": "s3://farm/lippmann", "s3_endpoint": "https://s3.example"}


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Broker]:
    broker = Broker(tmp_path)
    yield broker
    broker.kill()


@pytest.fixture
def broker_farm(make_farm: Callable[..., Farm], broker: Broker) -> Farm:
    return make_farm(coordinator=False, redis_url=broker.url, **BUCKET)


def users_of(broker: Broker) -> set[str]:
    return {name.decode() for name in broker.client.execute_command("ACL", "USERS")} - {"default"}


def test_a_user_whose_key_another_process_revokes_is_not_made_again_or_is_deleted(
    make_client: Callable[[Farm], Client], broker_farm: Farm, broker: Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    api, users = make_client(broker_farm), BrokerUsers(broker.url, timeout_s=5.0)
    key_id = api.post(PATH, json={"name": "x"}).json()["id"]
    with broker_farm.database.reading() as session:
        read_before = access_rows.worker_keys(session)
    assert api.delete(f"/api/v1/keys/{key_id}").status_code == 204
    assert users_of(broker) == set()
    with monkeypatch.context() as patched:
        patched.setattr(access_rows, "worker_keys", lambda session: read_before)
        users.reconcile(broker_farm.database, now_s=broker_farm.now_s)
    assert users_of(broker) == set()

    kept = api.post(PATH, json={"name": "kept"}).json()["id"]
    users.make(WorkerKey(key_id, bytes(32)))
    broker.client.execute_command("ACL", "SETUSER", "lippmann-worker-of-mine", "on")
    users._checked_s = float("-inf")
    users.reconcile(broker_farm.database, now_s=broker_farm.now_s)
    users.close()
    assert users_of(broker) == {user_of(kept), "lippmann-worker-of-mine"}


def test_while_a_broker_hangs_others_write_and_the_key_is_revoked(
    make_client: Callable[[Farm], Client], broker_farm: Farm, broker: Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    api = make_client(broker_farm)
    users = api.app.state.lippmann.broker_users  # type: ignore[attr-defined]
    make = users.make

    def hang(key: WorkerKey) -> bool:
        with broker_farm.database.writing() as session:
            assert session.get(Credential, key.id) is not None
        make(key)
        raise BrokerUnavailable("the broker does not answer: its answer was lost")

    monkeypatch.setattr(users, "make", hang)
    answer = api.post(PATH, json={"name": "x"})
    assert (answer.status_code, answer.json()["code"]) == (503, "broker-unavailable")
    assert api.get(PATH).json()["items"] == []
    assert [one["action"] for one in api.get("/api/v1/audit").json()["items"]] == ["revoke-key", "create-worker-key"]
    users.reconcile(broker_farm.database, now_s=broker_farm.now_s)
    assert users_of(broker) == set()
    with broker_farm.database.reading() as session:
        assert access_rows.worker_keys(session) == []


def test_a_broker_that_does_not_know_a_right_says_so(
    make_client: Callable[[Farm], Client], broker_farm: Farm, broker: Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    api = make_client(broker_farm)
    monkeypatch.setattr(broker_users, "RIGHTS", "%X~lippmann:directions")  # as Redis 6 does not know `%R~`
    answer = api.post(PATH, json={"name": "x"})
    assert answer.status_code == 422
    assert "expected a broker that makes users for worker keys, Redis 7 or later or Valkey, got: " in answer.text
    assert "%X~lippmann:directions" in answer.text
    with broker_farm.database.reading() as session:
        assert access_rows.worker_keys(session) == []


def test_a_broker_without_users_is_asked_once_while_no_key_has_one(
    broker_farm: Farm, broker: Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    users, asked = BrokerUsers(broker.url, timeout_s=5.0), []

    def refuse(*command: str) -> Any:
        asked.append(command)
        raise BadInput("got: unknown command 'ACL'")

    monkeypatch.setattr(users, "_ask", refuse)
    for _ in range(3):
        users._checked_s = float("-inf")
        users.reconcile(broker_farm.database, now_s=broker_farm.now_s)
    users.close()
    assert asked == [("USERS",)]


@pytest.mark.parametrize(("given", "user"), [("default", ""), ("default-farm", "default-farm"), ("", "")])
def test_the_user_of_a_join_file_is_the_whole_name(make_farm: Callable[..., Farm], given: str, user: str) -> None:
    farm = make_farm(coordinator=False, redis_url=f"redis://{given}:word@127.0.0.1:1/0", **BUCKET)
    assert _broker(farm.settings).user == user
