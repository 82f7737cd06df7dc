"""The manifests of deploy/kubernetes: valid, hardened, and in agreement with compose, the settings and each other."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import tomllib
from functools import cache
from typing import Any

import kubernetes_validate  # type: ignore[import-untyped]
import pytest
import yaml
from kubernetes_validate import utils as schemas
from pydantic import BaseModel

from service.main import SHUTDOWN_S
from service.settings import Settings
from tests.kustomize import Thing, build, containers_of, pods_of
from tests.repository import ROOT
from worker.settings import WorkerSettings

HERE = ROOT / "deploy/kubernetes"
OVERLAYS = ("small", "production", "gpu")
OURS: dict[str, type[BaseModel]] = {"lippmann-service": Settings, "lippmann-worker": WorkerSettings}
KUBERNETES = ("1.30", kubernetes_validate.latest_version())
"""The oldest and the newest release whose schemas the manifests keep to."""
UNITS = {"Mi": 1, "Gi": 1024}

in_every_overlay = pytest.mark.parametrize("overlay", OVERLAYS)


@cache
def objects(overlay: str) -> list[Thing]:
    return build(HERE / "overlays" / overlay)


def named(overlay: str, kind: str) -> dict[str, Thing]:
    return {each["metadata"]["name"]: each for each in objects(overlay) if each["kind"] == kind}


def environment(overlay: str, name: str) -> dict[str, str]:
    """Return the variables of our container in a pod; those of Secrets and of the pod's resources are stood in for."""
    (container,) = pods_of(objects(overlay))[name]["spec"]["containers"]
    maps = named(overlay, "ConfigMap")
    found = {
        key: value for each in container["envFrom"] for key, value in maps[each["configMapRef"]["name"]]["data"].items()
    }
    for each in container["env"]:
        resource = each["valueFrom"].get("resourceFieldRef")
        found[each["name"]] = container["resources"]["limits"][resource["resource"].split(".")[1]] if resource else "x"
    return found


def mib(text: str) -> int:
    return int(text[:-2]) * UNITS[text[-2:]]


def files_in(pod: Thing) -> set[str]:
    """Return the paths of the secrets that a container of a pod sees."""
    paths = set()
    volumes = {each["name"]: each for each in pod["spec"]["volumes"]}
    for mount in pod["spec"]["containers"][0]["volumeMounts"]:
        for source in volumes[mount["name"]].get("projected", {}).get("sources", []):
            paths |= {f"{mount['mountPath']}/{item['path']}" for item in source["secret"]["items"]}
    return paths


@pytest.mark.parametrize("version", KUBERNETES)
def test_every_object_is_one_that_kubernetes_accepts(version: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # Each object would read the whole schema again.
    monkeypatch.setattr(schemas, "schema_contents", cache(schemas.schema_contents))
    unique = {json.dumps(each, sort_keys=True): each for overlay in OVERLAYS for each in objects(overlay)}
    for each in unique.values():
        if not each["apiVersion"].startswith("keda.sh/"):  # no schema; see test_kubernetes_network
            kubernetes_validate.validate(each, version, strict=True)


def has_kustomize() -> bool:
    """Return whether there is a kubectl that knows its kustomize; that of Debian 12, 1.20, is older than its fields."""
    if shutil.which("kubectl") is None:
        return False
    ran = subprocess.run(["kubectl", "version", "--client", "--output=json"], capture_output=True, check=False)
    return b"kustomizeVersion" in ran.stdout


@pytest.mark.skipif(not has_kustomize(), reason="needs a kubectl later than that of Debian 12")
@pytest.mark.parametrize("folder", [f"overlays/{overlay}" for overlay in OVERLAYS])
def test_kustomize_makes_the_same_objects(folder: str) -> None:
    ran = subprocess.run(["kubectl", "kustomize", HERE / folder], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    # A generated name ends with a digest, wherever it stands.
    generated = {each["metadata"]["name"] for each in build(HERE / folder) if each["kind"] == "ConfigMap"}
    theirs = re.sub(rf"\b({'|'.join(generated)})-[a-z0-9]{{10}}\b", r"\1", ran.stdout)
    assert by_name(yaml.safe_load_all(theirs)) == by_name(build(HERE / folder))


def by_name(found: Any) -> dict[tuple[str, str], Thing]:
    return {(each["kind"], each["metadata"]["name"]): in_order(each) for each in found}


def in_order(found: Any) -> Any:
    """Return an object with its lists of named things sorted: kustomize puts those that it has patched first."""
    if isinstance(found, dict):
        return {key: in_order(value) for key, value in found.items()}
    if isinstance(found, list) and all(isinstance(each, dict) and "name" in each for each in found):
        return sorted(map(in_order, found), key=lambda each: str(each["name"]))
    return [in_order(each) for each in found] if isinstance(found, list) else found


@pytest.mark.promise(
    "Containers",
    "In Kubernetes, no container is root, has capabilities or a token of the cluster, gains rights, or writes outside "
    "its volumes.",
)
@in_every_overlay
def test_no_pod_has_rights(overlay: str) -> None:
    assert named(overlay, "Namespace")["lippmann"]["metadata"]["labels"] == {
        "pod-security.kubernetes.io/enforce": "restricted"
    }
    for name, pod in pods_of(objects(overlay)).items():
        spec = pod["spec"]
        assert spec["securityContext"]["runAsNonRoot"] is True, name
        assert spec["securityContext"]["seccompProfile"] == {"type": "RuntimeDefault"}, name
        assert spec["automountServiceAccountToken"] is False, name
        # A Service of the cluster sets variables, and one called `lippmann` would set LIPPMANN_PORT.
        assert spec["enableServiceLinks"] is False, name
        assert not {"hostNetwork", "hostPID", "hostIPC"} & set(spec), name
        assert not any("hostPath" in volume for volume in spec["volumes"]), name
    for container in containers_of(objects(overlay)):
        assert container["securityContext"] == {
            "allowPrivilegeEscalation": False, "readOnlyRootFilesystem": True, "capabilities": {"drop": ["ALL"]},
        }, container["name"]  # fmt: skip


@in_every_overlay
def test_our_pods_run_as_the_user_of_the_images(overlay: str) -> None:
    for name in OURS:
        rights = pods_of(objects(overlay))[name]["spec"]["securityContext"]
        assert (rights["runAsUser"], rights["runAsGroup"], rights["fsGroup"]) == (10001, 10001, 10001)


@in_every_overlay
@pytest.mark.parametrize("name", OURS)
def test_every_setting_is_one_of_the_code_with_a_value_that_it_takes(
    overlay: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = environment(overlay, name)
    ours = {key.removeprefix("LIPPMANN_").lower() for key in found if key.startswith("LIPPMANN_")}
    assert ours <= set(OURS[name].model_fields)
    for key, value in found.items():
        monkeypatch.setenv(key, value)
    OURS[name]()


@in_every_overlay
@pytest.mark.parametrize("name", OURS)
def test_every_file_of_a_setting_is_mounted_and_nothing_else(overlay: str, name: str) -> None:
    pod = pods_of(objects(overlay))[name]
    files = {value for key, value in environment(overlay, name).items() if value.startswith("/run/secrets/")}
    assert files == files_in(pod)
    (secrets,) = (volume for volume in pod["spec"]["volumes"] if volume["name"] == "secrets")
    assert secrets["projected"]["defaultMode"] == 0o440


def test_the_images_of_a_release_have_its_version() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    for overlay in ("production", "gpu"):
        images = {container["image"].rpartition("/")[2] for container in containers_of(objects(overlay))}
        assert images == {f"lippmann-service:{version}", f"lippmann-worker:{version}"}


@in_every_overlay
def test_what_a_container_may_use_is_enough_for_its_settings(overlay: str) -> None:
    for name, pod in pods_of(objects(overlay)).items():
        if name in OURS:
            (container,) = pod["spec"]["containers"]
            folders = sum(mib(each["emptyDir"]["sizeLimit"]) for each in pod["spec"]["volumes"] if "emptyDir" in each)
            assert folders < mib(container["resources"]["limits"]["ephemeral-storage"])
    worker = environment(overlay, "lippmann-worker")
    pod = pods_of(objects(overlay))["lippmann-worker"]
    (scratch,) = (each["emptyDir"]["sizeLimit"] for each in pod["spec"]["volumes"] if each["name"] == "scratch")
    bundles_mb = float(worker.get("LIPPMANN_BUNDLES_MB", WorkerSettings.model_fields["bundles_mb"].default))
    assert 2 * bundles_mb < mib(scratch)
    (container,) = pods_of(objects(overlay))["lippmann-worker"]["spec"]["containers"]
    assert int(worker["LIPPMANN_SLOTS"]) * int(worker["LIPPMANN_MEMORY_MB"]) < mib(
        container["resources"]["limits"]["memory"]
    )


@in_every_overlay
def test_a_pod_has_the_time_to_end(overlay: str) -> None:
    spec = pods_of(objects(overlay))["lippmann-service"]["spec"]
    _, pause_s = spec["containers"][0]["lifecycle"]["preStop"]["exec"]["command"]
    assert spec["terminationGracePeriodSeconds"] >= int(pause_s) + 2 * SHUTDOWN_S
    drain_s = float(environment(overlay, "lippmann-worker")["LIPPMANN_DRAIN_S"])
    assert pods_of(objects(overlay))["lippmann-worker"]["spec"]["terminationGracePeriodSeconds"] >= drain_s + 30
