"""Containers: linted, and every command is one that `lippmann` really has."""

from __future__ import annotations

import json
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import pytest

from tests.repository import ROOT

BIN = Path(sysconfig.get_path("scripts"))
DOCKERFILES = sorted((ROOT / "deploy/images").glob("*.Dockerfile"))


def composed() -> dict[str, dict[str, object]]:
    ran = subprocess.run(
        [BIN / "docker-compose", "--file", ROOT / "docker-compose.yml", "config", "--format", "json"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    services: dict[str, dict[str, object]] = json.loads(ran.stdout)["services"]
    return services


def sources_of(dockerfile: Path) -> list[str]:
    """Return what a Dockerfile copies out of the folder."""
    copies = [line.split()[1:-1] for line in dockerfile.read_text().splitlines() if line.startswith("COPY ")]
    return [source for sources in copies if not sources[0].startswith("--from") for source in sources]


def test_the_compose_file_is_valid() -> None:
    assert set(composed()) == {"redis", "service", "worker"}


@pytest.mark.promise(
    "Containers", "In compose, no container has capabilities, gains rights, or writes outside its volumes and `/tmp`."
)
@pytest.mark.parametrize("service", ["redis", "service", "worker"])
def test_no_container_gains_rights_or_writes_outside_its_volumes(service: str) -> None:
    described = composed()[service]
    assert described.get("user") == {"redis": "redis"}.get(service), "our images have a user of their own"
    assert described["read_only"] is True
    assert described["cap_drop"] == ["ALL"]
    # Nothing replaces Docker's own filter of system calls, or its AppArmor profile.
    assert described["security_opt"] == ["no-new-privileges:true"]
    assert described["tmpfs"] == ["/tmp:size=1g,mode=1777"]
    assert described["pids_limit"] == 4096
    assert not {"privileged", "cap_add", "devices", "pid", "ipc", "userns_mode", "network_mode"} & set(described)
    assert all(volume["type"] == "volume" for volume in described["volumes"])  # type: ignore[attr-defined]


@pytest.mark.promise("Containers", "The images do not run as root.")
@pytest.mark.parametrize("dockerfile", DOCKERFILES, ids=lambda path: path.name)
def test_no_image_runs_as_root(dockerfile: Path) -> None:
    users = [line.split()[1] for line in dockerfile.read_text().splitlines() if line.startswith("USER ")]
    assert users[-1] == "10001"


@pytest.mark.promise("Containers", "In compose, broker and workers are on a network without a way out.")
def test_only_the_service_is_reached_from_outside() -> None:
    services = composed()
    assert [name for name, described in services.items() if "ports" in described] == ["service"]
    assert [set(services[name]["networks"]) for name in ("redis", "worker")] == [{"broker"}, {"broker"}]  # type: ignore[call-overload]


def test_a_worker_in_a_container_finds_its_sandbox_by_trying() -> None:
    environment = composed()["worker"]["environment"]
    assert environment["LIPPMANN_SANDBOX"] == "auto"  # type: ignore[index]


@pytest.mark.parametrize("dockerfile", DOCKERFILES, ids=lambda path: path.name)
def test_the_dockerfiles_are_clean(dockerfile: Path) -> None:
    ran = subprocess.run([BIN / "hadolint", dockerfile], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout


@pytest.mark.parametrize("service", ["service", "worker"])
def test_a_services_command_is_one_that_lippmann_has(service: str) -> None:
    command = composed()[service]["command"]
    assert isinstance(command, list)
    assert command[0] == "lippmann"
    ran = subprocess.run([BIN / "lippmann", *command[1:], "--help"], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr


def test_the_images_get_what_they_copy_and_nothing_else_of_the_folder() -> None:
    copied = {source for dockerfile in DOCKERFILES for source in sources_of(dockerfile)}
    assert all((ROOT / source).exists() for source in copied)
    lines = (ROOT / ".dockerignore").read_text().splitlines()
    assert lines[1] == "*"
    assert {line.removeprefix("!") for line in lines if line.startswith("!")} == copied


@pytest.mark.promise("Containers", "In compose, service and worker log in to the broker as users of their own.")
def test_service_and_worker_have_users_and_passwords_of_their_own_at_the_broker() -> None:
    services: dict[str, Any] = composed()
    assert "--aclfile" in services["redis"]["command"]
    for name in ("service", "worker"):
        described = services[name]
        assert f"//lippmann-{name}@" in described["environment"]["LIPPMANN_REDIS_URL"]
        secrets = {secret["source"]: secret.get("target", secret["source"]) for secret in described["secrets"]}
        assert secrets.keys() == {f"broker-{name}", "order-key"}
        target = secrets[f"broker-{name}"]
        assert described["environment"]["LIPPMANN_REDIS_PASSWORD_FILE"] == f"/run/secrets/{target}"


@pytest.mark.promise(
    "Containers", "In compose, a worker has the artifacts and the key of messages; database and other keys it has not."
)
def test_a_worker_has_nothing_of_the_service_but_the_artifacts() -> None:
    services: dict[str, Any] = composed()
    ours = {volume["source"] for volume in services["service"]["volumes"]}
    (shared,) = (volume for volume in services["worker"]["volumes"] if volume["source"] in ours)
    assert shared["volume"]["subpath"] == "artifacts"
    assert shared["target"] == "/data/artifacts"
    environments = [services[name]["environment"] for name in ("service", "worker")]
    assert {one["LIPPMANN_ORDER_KEY_FILE"] for one in environments} == {"/run/secrets/order-key"}
