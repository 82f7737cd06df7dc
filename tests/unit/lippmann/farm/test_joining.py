"""Joining a farm: what a join file makes of the environment of a worker, and of the options of who made it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter

from lippmann.errors import BadInput
from lippmann.farm.joining import complete, join_farm, notes_on
from lippmann.job.messages.worker_keys import WorkerKey
from lippmann.join_file import JoinFile
from tests.unit.lippmann.test_join_file import JOIN, SECRET
from worker.settings import WorkerSettings

NOTHING: dict[str, Any] = dict.fromkeys(("redis_url", "password_file", "s3_endpoint", "access_key_file"))


def test_a_worker_has_all_its_settings_from_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    environment: dict[str, str] = {}
    assert join_farm(JOIN, tmp_path, environment) == []
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    settings = WorkerSettings(data_dir=tmp_path)
    assert settings.broker == "rediss://lippmann-worker:a%2Fb%27%22%5Cc@broker.example:6379/0"
    assert (settings.store_url, settings.s3_endpoint) == ("s3://farm/lippmann", "https://s3.example:8333")
    assert [key.hex() for key in settings.order_keys.keys()] == list(JOIN.order_keys)  # noqa: SIM118 - no mapping
    assert settings.worker_key == WorkerKey.of_secret(JOIN.worker.id, SECRET)
    assert settings.instance.startswith(f"{JOIN.worker.id}.")
    assert settings.seals.worker_key == settings.worker_key
    keys = Path(environment["AWS_SHARED_CREDENTIALS_FILE"]).read_text()
    assert keys == "[default]\naws_access_key_id = AK\naws_secret_access_key = SK\n"
    folder = tmp_path / "join" / JOIN.worker.id
    assert {path.stat().st_mode & 0o777 for path in folder.iterdir()} == {0o600}
    assert folder.stat().st_mode & 0o777 == 0o700
    assert not any(secret in str(environment) for secret in (SECRET, "SK", JOIN.order_keys[0]))
    before = {path.name for path in folder.iterdir()}
    join_farm(JOIN, tmp_path, environment)
    assert {path.name for path in folder.iterdir()} == before, "no temporary file is left"


def test_the_pool_and_the_tags_of_a_file_count_and_without_them_those_of_the_environment(tmp_path: Path) -> None:
    labelled = JOIN.model_copy(update={"worker": JOIN.worker.model_copy(update={"pool": "night", "tags": ("a", "b")})})
    environment = {"LIPPMANN_WORKER_POOL": "day"}
    assert join_farm(JOIN, tmp_path, environment) == []
    assert environment["LIPPMANN_WORKER_POOL"] == "day"
    assert join_farm(labelled, tmp_path, environment) == ["LIPPMANN_WORKER_POOL"]
    assert (environment["LIPPMANN_WORKER_POOL"], environment["LIPPMANN_WORKER_TAGS"]) == ("night", "a,b")


def test_what_the_environment_says_of_another_farm_does_not_count_and_is_named(tmp_path: Path) -> None:
    environment = {
        "LIPPMANN_REDIS_URL": "redis://other", "LIPPMANN_S3_REGION": "there", "LIPPMANN_SLOTS": "3",
        "AWS_ACCESS_KEY_ID": "other", "LIPPMANN_REDIS_CA_FILE": "/other.pem",
    }  # fmt: skip
    named = join_farm(JOIN, tmp_path, environment)
    assert named == ["AWS_ACCESS_KEY_ID", "LIPPMANN_REDIS_CA_FILE", "LIPPMANN_REDIS_URL", "LIPPMANN_S3_REGION"]
    assert environment["LIPPMANN_REDIS_URL"] == "rediss://lippmann-worker@broker.example:6379/0"
    assert environment["LIPPMANN_SLOTS"] == "3"
    assert not set(named[:2] + named[3:]) & set(environment)


def test_options_take_the_place_of_what_the_service_says(tmp_path: Path) -> None:
    password, keys = tmp_path / "password", tmp_path / "keys"
    for path, text in ((password, "word\n"), (keys, "[default]\naws_access_key_id=A\naws_secret_access_key=S\n")):
        path.touch(0o600)
        path.write_text(text)
    changed = complete(
        JOIN, redis_url="rediss://w@other:7/1", password_file=password, s3_endpoint="https://s", access_key_file=keys
    )
    assert changed.broker.model_dump(exclude={"ca"}) == {"url": "rediss://other:7/1", "user": "w", "password": "word"}
    assert (changed.store.endpoint, changed.store.access_key, changed.store.secret_key) == ("https://s", "A", "S")
    assert complete(JOIN, **NOTHING) == JOIN


@pytest.mark.parametrize("url", ["redis://:word@other", "http://other", "redis://other?x=1"])
def test_a_wrong_address_is_refused(url: str) -> None:
    with pytest.raises(BadInput):
        complete(JOIN, **{**NOTHING, "redis_url": url})


def test_what_will_not_work_elsewhere_is_noted() -> None:
    def notes(**broker: str) -> str:
        changed = JOIN.model_dump() | {"broker": JOIN.broker.model_dump() | broker}
        return "; ".join(notes_on(TypeAdapter(JoinFile).validate_python(changed)))

    assert notes() == ""
    assert "other machines do not reach" in notes(url="rediss://127.0.0.1:6379/0")
    assert "no TLS" in notes(url="redis://broker:6379/0")
    (of_service,) = notes_on(JOIN, is_of_service=True)
    assert "the password of the service itself" in of_service
