"""The settings that are refused when the service starts."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from fastapi.routing import iter_route_contexts
from sqlalchemy import make_url

from lippmann.broker_settings import BrokerSettings
from lippmann.errors import BadInput
from service.main import create_app
from service.settings import OWN_PATHS, Settings
from tests.builders_service import Farm
from worker.settings import WorkerSettings


@pytest.mark.parametrize(
    ("public_url", "prefix"),
    [
        ("", ""),
        ("https://farm.example", ""),
        ("https://farm.example/", ""),
        ("https://farm.example/lippmann", "/lippmann"),
        ("http://[::1]:8080/lab_2/a.b~c-d/", "/lab_2/a.b~c-d"),
    ],
)
def test_the_path_of_the_public_url_is_the_prefix(public_url: str, prefix: str) -> None:
    assert Settings(public_url=public_url).path_prefix == prefix


@pytest.mark.parametrize(
    "path",
    ["?a=b", "#top", "a b", "a//b", "../a", ".", "ä", 'a"b', "a%20b", "a;b", "api", "api/farm", "static", "login"],
)
def test_a_path_that_is_not_plain_or_could_be_one_of_the_service_is_refused(path: str) -> None:
    with pytest.raises(BadInput, match="LIPPMANN_PUBLIC_URL"):
        Settings(public_url=f"https://farm.example/{path}")


@pytest.mark.parametrize(
    "url",
    ["ws://farm.example:11222/driver", "wss://localhost:1/", "ws://localhost/driver", "ws://localhost:1/; img-src *"],
)
def test_a_panel_is_only_on_the_machine_of_the_user(url: str) -> None:
    assert Settings(panel_url="ws://localhost:11222/driver").panel_url == "ws://localhost:11222/driver"
    with pytest.raises(BadInput, match="LIPPMANN_PANEL_URL"):
        Settings(panel_url=url)


def test_every_path_of_the_service_is_known_to_the_settings(farm: Farm) -> None:
    paths = [str(route.path) for route in iter_route_contexts(create_app(farm.settings, farm.parts).routes)]
    assert {path.split("/")[1] for path in paths} - {""} == OWN_PATHS


@pytest.mark.parametrize("name", ["data", "a?b", "a#b", "a%41", "ä b+c", os.fsdecode(b"caf\xe9%3f"), "a:b@c;d&e=f"])
def test_the_database_is_in_the_data_folder_whatever_its_name_is(tmp_path: Path, name: str) -> None:
    url = make_url(Settings(data_dir=tmp_path / name).database)
    assert (url.database, url.query) == (str(tmp_path / name / "lippmann.db"), {})


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("LEASE_TTL_S", "abc", "LIPPMANN_LEASE_TTL_S: expected a number, got 'abc'"),
        ("TICK_S", "0", "LIPPMANN_TICK_S: expected a number above 0, got '0'"),
        ("LOG_FORMAT", "xml", "LIPPMANN_LOG_FORMAT: expected 'plain' or 'json', got 'xml'"),
        (
            "TRUSTED_PROXIES",
            "my-proxy",
            "LIPPMANN_TRUSTED_PROXIES: expected addresses and networks, such as 10.0",
        ),
        (
            "STORE_URL",
            "s3://me:hunter2@b",
            "LIPPMANN_STORE_URL: expected s3://bucket or s3://bucket/prefix, got an",
        ),
        ("OIDC_ISSUER", "https://id.example", "expected LIPPMANN_OIDC_CLIENT_ID beside LIPPMANN_OIDC_ISSUER, got none"),
        ("OIDC_ROLES", "lab", "expected JSON where a setting is an object, got another text: .*oidc_roles"),
    ],
)
def test_a_setting_of_the_environment_that_is_invalid_is_named_in_one_line(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str, message: str
) -> None:
    monkeypatch.setenv(f"LIPPMANN_{name}", value)
    with pytest.raises(BadInput, match=f"^{message}") as refused:
        Settings()
    assert "\n" not in refused.value.message
    assert "hunter2" not in refused.value.message


@pytest.mark.parametrize("kind", [Settings, WorkerSettings])
def test_an_empty_variable_counts_as_one_that_is_not_set(
    monkeypatch: pytest.MonkeyPatch, kind: type[BrokerSettings]
) -> None:
    for name in os.environ:
        if name.startswith("LIPPMANN_"):
            monkeypatch.delenv(name)
    monkeypatch.setattr("platform.node", lambda: "host")
    unset = kind()
    for name in kind.model_fields:
        monkeypatch.setenv(f"LIPPMANN_{name.upper()}", "")
    assert kind().model_dump() == unset.model_dump()
