"""What selects what in deploy/kubernetes, and which ways there are between its pods."""

from __future__ import annotations

import json
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest

from tests.kustomize import Thing, pods_of
from tests.repository import ROOT
from tests.rules.test_kubernetes import OURS, environment, in_every_overlay, named, objects

OPENAPI = json.loads((ROOT / "service/openapi.json").read_text())
NAMES = {("kube-system", 53)}


def chosen(overlay: str, selector: Thing) -> set[str]:
    """Return the names of the objects whose pods a selector chooses."""
    found = set()
    for name, pod in pods_of(objects(overlay)).items():
        labels = pod["metadata"]["labels"]
        fits = all(labels.get(key) == value for key, value in selector.get("matchLabels", {}).items())
        for rule in selector.get("matchExpressions", []):
            assert rule["operator"] == "In"
            fits &= labels.get(rule["key"]) in rule["values"]
        found |= {name} if fits else set()
    return found


def ways_out(overlay: str, name: str) -> set[tuple[str, int]]:
    """Return the places to which the pods of an object may connect, each with a port."""
    return ways(overlay, name, "egress", "to")


def ways(overlay: str, name: str, direction: str, side: str) -> set[tuple[str, int]]:
    found = set()
    for policy in named(overlay, "NetworkPolicy").values():
        if name in chosen(overlay, policy["spec"]["podSelector"]):
            for rule in policy["spec"].get(direction, []):
                assert rule[side], "an empty list would be everywhere"
                assert rule["ports"], "an empty list would be every port"
                places = {place for peer in rule[side] for place in places_of(overlay, peer)}
                found |= {(place, port["port"]) for place in places for port in rule["ports"]}
    return found


def places_of(overlay: str, peer: Thing) -> set[str]:
    if "ipBlock" in peer:
        return {peer["ipBlock"]["cidr"]}
    if "namespaceSelector" in peer:
        spaces = peer["namespaceSelector"]
        key = "kubernetes.io/metadata.name"
        return {spaces["matchLabels"][key]} if "matchLabels" in spaces else set(spaces["matchExpressions"][0]["values"])
    return chosen(overlay, peer["podSelector"])


@in_every_overlay
def test_every_selector_chooses_the_pods_that_it_means(overlay: str) -> None:
    for kind in ("Deployment", "StatefulSet"):
        for name, each in named(overlay, kind).items():
            assert chosen(overlay, each["spec"]["selector"]) == {name}
    for name, each in named(overlay, "PodDisruptionBudget").items():
        assert chosen(overlay, each["spec"]["selector"]) == {name}
    for name, each in named(overlay, "Service").items():
        (pod,) = chosen(overlay, {"matchLabels": each["spec"]["selector"]})
        assert pod == name or (pod, name) == ("lippmann-service", "lippmann-processes")
        (port,), (container,) = each["spec"]["ports"], pods_of(objects(overlay))[pod]["spec"]["containers"]
        assert port["targetPort"] in {one["name"] for one in container["ports"]}
        # Prometheus misses a process only if it still knows its address.
        assert each["spec"].get("publishNotReadyAddresses", False) is (name == "lippmann-processes")
    for name, each in named(overlay, "NetworkPolicy").items():
        assert chosen(overlay, each["spec"]["podSelector"]), name
        assert set(each["spec"]["policyTypes"]) >= {"Ingress"} & {"Ingress" if "ingress" in each["spec"] else ""}, name
    for each in named(overlay, "Ingress").values():
        backend = each["spec"]["rules"][0]["http"]["paths"][0]["backend"]["service"]
        service = named(overlay, "Service")[backend["name"]]
        assert backend["port"]["name"] in {port["name"] for port in service["spec"]["ports"]}


@pytest.mark.promise(
    "Containers",
    "In Kubernetes, a worker reaches the broker, the bucket and the names of hosts, and nobody reaches a worker.",
)
@in_every_overlay
def test_a_worker_reaches_broker_and_bucket_and_nothing_else(overlay: str) -> None:
    servers = {"small": ("redis", "store"), "production": ("192.0.2.10/32", "192.0.2.30/32")}
    broker, bucket = servers.get(overlay, servers["production"])
    found = environment(overlay, "lippmann-worker")
    ports = urlsplit(found["LIPPMANN_REDIS_URL"]).port, port_of(found["LIPPMANN_S3_ENDPOINT"])
    assert ways_out(overlay, "lippmann-worker") - NAMES == {(broker, ports[0]), (bucket, ports[1])}
    assert ways(overlay, "lippmann-worker", "ingress", "from") == set()
    # Without this policy everything would be allowed in both directions.
    spec = named(overlay, "NetworkPolicy")["nothing-else"]["spec"]
    assert spec == {"podSelector": {}, "policyTypes": ["Ingress", "Egress"]}


def port_of(url: str) -> int:
    parts = urlsplit(url)
    return parts.port or {"http": 80, "https": 443}[parts.scheme]


@in_every_overlay
def test_the_service_reaches_what_a_worker_does_and_its_database(overlay: str) -> None:
    more = ways_out(overlay, "lippmann-service") - ways_out(overlay, "lippmann-worker")
    assert 5432 in {port for _, port in more}
    inside = {"ingress-nginx"} if overlay == "small" else {"ingress-nginx", "keda", "monitoring"}
    assert ways(overlay, "lippmann-service", "ingress", "from") == {(place, 8080) for place in inside}


def test_the_servers_of_the_small_farm_are_reached_by_the_farm_alone() -> None:
    reached = {name: ways("small", name, "ingress", "from") for name in ("redis", "database", "store")}
    both = set(OURS)
    assert {name: {place for place, _ in found} for name, found in reached.items()} == {
        "redis": both, "database": {"lippmann-service"}, "store": both,
    }  # fmt: skip
    for name, found in reached.items():
        (port,) = named("small", "Service")[name]["spec"]["ports"]
        assert {number for _, number in found} == {port["port"]}
        assert ways_out("small", name) == NAMES


@in_every_overlay
def test_a_probe_asks_for_health_and_the_port_is_that_of_the_command(overlay: str) -> None:
    (container,) = pods_of(objects(overlay))["lippmann-service"]["spec"]["containers"]
    for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
        path = container[probe]["httpGet"]["path"]
        assert path in OPENAPI["paths"]
    (port,) = container["ports"]
    assert container["command"][-2:] == ["--port", str(port["containerPort"])]


@pytest.mark.parametrize("overlay", ["production", "gpu"])
def test_keda_reads_a_field_of_the_api_with_a_token_of_the_service(overlay: str) -> None:
    # kubernetes-validate has no schema of KEDA; both objects fit its definitions of 2026-08.
    scaled: Any = named(overlay, "ScaledObject")["lippmann-worker"]["spec"]
    assert scaled["scaleTargetRef"]["name"] in named(overlay, "Deployment")
    assert "replicas" not in named(overlay, "Deployment")["lippmann-worker"]["spec"], "KEDA sets the number"
    (trigger,) = scaled["triggers"]
    url = urlsplit(trigger["metadata"]["url"])
    assert url.netloc == "lippmann-service.lippmann.svc:8080"
    worker = environment(overlay, "lippmann-worker")
    asked = {
        "pool": [worker.get("LIPPMANN_WORKER_POOL", "")], "memory_mb": [worker["LIPPMANN_MEMORY_MB"]],
        "tag": worker.get("LIPPMANN_WORKER_TAGS", "").split(","),
    }  # fmt: skip
    assert parse_qs(url.query, keep_blank_values=True) == {
        key: value for key, value in asked.items() if key != "tag" or any(value)
    }
    answer = OPENAPI["paths"][url.path]["get"]["responses"]["200"]["content"]["application/json"]["schema"]["$ref"]
    fields = OPENAPI["components"]["schemas"][answer.rpartition("/")[2]]["properties"]
    assert fields[trigger["metadata"]["valueLocation"]]["type"] == "integer"
    assert trigger["metadata"]["targetValue"] == environment(overlay, "lippmann-worker")["LIPPMANN_SLOTS"]
    (secret,) = named(overlay, "TriggerAuthentication")[trigger["authenticationRef"]["name"]]["spec"]["secretTargetRef"]
    (container,) = pods_of(objects(overlay))["lippmann-service"]["spec"]["volumes"][:1]
    sources = {each["secret"]["name"]: each["secret"]["items"] for each in container["projected"]["sources"]}
    assert {"key": secret["key"], "path": "metrics-token"} in sources[secret["name"]]


def test_a_worker_of_the_gpu_overlay_asks_for_one() -> None:
    spec = pods_of(objects("gpu"))["lippmann-worker"]["spec"]
    assert spec["containers"][0]["resources"]["limits"]["nvidia.com/gpu"] == "1"
    assert spec["nodeSelector"] == {"nvidia.com/gpu.present": "true"}
    assert environment("gpu", "lippmann-worker")["LIPPMANN_WORKER_TAGS"] == "gpu", "jobs may ask for it"
    assert "graphics" in environment("gpu", "lippmann-worker")["NVIDIA_DRIVER_CAPABILITIES"], "OptiX is a part of it"
