"""The containers of deploy/kubernetes are those of compose."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.kustomize import pods_of
from tests.repository import ROOT
from tests.rules.test_deploy import services
from tests.rules.test_kubernetes import environment, in_every_overlay, named, objects
from tests.rules.test_kubernetes_secrets import made

CLUSTER = ROOT / "deploy/compose/cluster.yml"


@pytest.mark.parametrize("name", ["service", "worker"])
def test_our_containers_are_those_of_compose(name: str) -> None:
    theirs: Any = services()[name]
    (ours,) = pods_of(objects("small"))[f"lippmann-{name}"]["spec"]["containers"]
    assert ours["command"] == theirs["command"]
    assert ours["image"] == f"lippmann-{name}", "what compose calls the image that it builds"
    found = environment("small", f"lippmann-{name}")
    for key in ("LIPPMANN_REDIS_URL", "LIPPMANN_REDIS_PASSWORD_FILE", "LIPPMANN_ORDER_KEY_FILE", "LIPPMANN_DATA_DIR"):
        assert found[key] == theirs["environment"][key], key
    if name == "worker":
        assert found["LIPPMANN_HEARTBEAT_FILE"] == theirs["environment"]["LIPPMANN_HEARTBEAT_FILE"]
        for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
            assert ours[probe]["exec"]["command"] == theirs["healthcheck"]["test"][1:]


@pytest.mark.parametrize("name", ["redis", "database", "store"])
def test_the_servers_of_the_small_farm_are_those_of_compose(name: str) -> None:
    theirs: Any = services(CLUSTER)[name]
    (ours,) = pods_of(objects("small"))[name]["spec"]["containers"]
    files = {str(Path("/run/secrets", each["target"])) for each in theirs["secrets"]}
    (volume,) = theirs["volumes"]
    assert {"/run/secrets", volume["target"]} <= {mount["mountPath"] for mount in ours["volumeMounts"]}
    assert ours.get("command") == theirs["command"]
    if name == "store":
        assert f"FROM {ours['image']}\n" in (ROOT / "deploy/images/store.Dockerfile").read_text()
    else:
        assert ours["image"] == theirs["image"]
        assert ours["readinessProbe"]["exec"]["command"] == theirs["healthcheck"]["test"][1:]
    assert {each["name"]: each["value"] for each in ours.get("env", [])} == (theirs.get("environment") or {})
    volumes = pods_of(objects("small"))[name]["spec"]["volumes"]
    (source,) = (each["secret"]["secretName"] for each in volumes if "secret" in each)
    assert {f"/run/secrets/{key}" for key in made("small")[source]} == files


def test_the_role_of_the_service_in_the_database_is_that_of_compose() -> None:
    (ours,) = named("small", "ConfigMap")["database-role"]["data"].values()
    assert ours == (ROOT / "deploy/compose/database-role.sql").read_text()


@in_every_overlay
def test_the_database_is_upgraded_before_the_service_starts(overlay: str) -> None:
    spec = pods_of(objects(overlay))["lippmann-service"]["spec"]
    (first,), (service,) = spec["initContainers"], spec["containers"]
    assert first["command"] == services(CLUSTER)["migrate"]["command"]
    assert first["image"] == service["image"]
    assert first["env"] == service["env"], "the same database"
