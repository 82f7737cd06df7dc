"""docker-compose.yml and its overrides: every line of their comments is run as a user would, on processes.

`tests.composition` says what is not here: Docker itself, and images.
"""

from __future__ import annotations

import json
import re
import ssl
import subprocess
import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from lippmann.client import Client
from lippmann.job.states import JobStatus
from tests.composition.composition import Composition, commands_of, composition
from tests.repository import DOCS, ROOT
from tests.waiting import ENOUGH_S

OVERRIDES = ROOT / "deploy/compose"
LINK = "docker compose exec service lippmann keys link"
FETCHED = {"video/centre.mp4", "orthoscopic/0001.png", "orthoscopic/0002.png"}


def follow(farm: Composition, file: Path) -> dict[str, str]:
    """Run the lines of the comments of a file, and return what each printed."""
    lines = commands_of(file)
    assert lines, f"expected commands in the comments of {file}, got none"
    return {line: farm.type(line) for line in lines}


@contextmanager
def logged_in(link: str, verify: ssl.SSLContext | bool = True) -> Iterator[httpx.Client]:
    """Open a login link as a browser does, and yield the browser."""
    with httpx.Client(base_url=link.partition("/login")[0], verify=verify, timeout=ENOUGH_S) as browser:
        answer = browser.get(link)
        assert (answer.status_code, answer.headers["location"]) == (303, "/")
        assert "Log in" not in browser.get("/").text
        yield browser


def check_job(farm: Composition) -> None:
    """See that the job of the comments was done by the two workers, and that its files were copied out."""
    key = farm.type("docker compose exec service cat /data/admin.key").strip()
    with Client(farm.url, key, patience_s=ENOUGH_S) as client:
        assert client.job(farm.job_id).status is JobStatus.DONE
        assert len(client.workers().items) == 2


def test_the_comments_of_the_small_farm_lead_to_a_login_a_key_and_a_job(tmp_path: Path) -> None:
    with composition(tmp_path) as farm:
        printed = follow(farm, ROOT / "docker-compose.yml")
        with logged_in(printed[LINK].strip()) as browser:
            assert browser.get("/api/v1/session").json() == {"name": "admin", "role": "admin", "owner_id": "admin"}
        key = printed["docker compose exec service lippmann keys create me --role submitter"].strip()
        headers = {"Authorization": f"Bearer {key}"}
        assert httpx.get(f"{farm.url}/api/v1/session", headers=headers).json()["role"] == "submitter"
        assert "admin.key has a new admin key; `lippmann keys link`" in printed["docker compose logs service"]
        check_job(farm)
        fetched = farm.clone / "out" / farm.job_id
        assert {path.relative_to(fetched).as_posix() for path in fetched.rglob("*")} >= FETCHED
        # Each worker has its artifacts and its scratch folder; the database is the service's alone.
        for worker in farm.containers["worker"]:
            assert {target for target, (_, writable) in worker.mounts.items() if writable} == {
                "/data/artifacts",
                "/data/scratch",
                "/tmp",
            }
        check_restore(farm)
        assert farm.containers["service"][0].stop() == 0, "the service ends well when it is told to"


def check_restore(farm: Composition) -> None:
    """Back the farm up and restore it into new volumes, as docs/containers.md says, with what gpu.yml adds."""
    section = (DOCS / "containers.md").read_text().partition("## Backup and restore\n")[2].partition("\n## ")[0]
    *lines, up = re.findall(r"^docker .*$", section, re.MULTILINE)
    assert len(lines) == 4
    for line in lines:
        farm.type(line)
    assert up in commands_of(OVERRIDES / "gpu.yml")
    follow(farm, OVERRIDES / "gpu.yml")
    key = farm.type("docker compose exec service cat /data/admin.key").strip()
    with Client(farm.url, key, patience_s=ENOUGH_S) as client:
        assert client.job(farm.job_id).status is JobStatus.DONE


@pytest.mark.promise("Containers", "In compose, the object store does nothing for containers without a key.")
def test_the_comments_of_the_cluster_lead_to_a_login_a_job_and_a_backup(tmp_path: Path) -> None:
    with composition(tmp_path) as farm:
        printed = follow(farm, OVERRIDES / "cluster.yml")
        with logged_in(printed[LINK].strip()) as browser:
            assert browser.get("/api/v1/session").json()["role"] == "admin"
        check_job(farm)
        with tarfile.open(farm.clone / "monday.tar") as backup:
            manifest = backup.extractfile("monday/manifest.json")
            assert manifest is not None
            assert json.load(manifest)["artifacts"]["count"] > 0
        assert not (farm.folder / "volumes/data/artifacts").exists(), "the artifacts are in the bucket"
        assert not (farm.folder / "volumes/data/lippmann.db").exists(), "the database is PostgreSQL"
        check_store_is_closed(farm)


def check_store_is_closed(farm: Composition) -> None:
    """See that the ports of the store that other containers reach want a key."""
    assert httpx.get(f"http://127.0.0.1:{farm.ports['8333']}/farm/lippmann/.store").status_code == 403
    port, empty = farm.stores["s3.port.grpc"], b"\0\0\0\0\0"
    url = f"http://127.0.0.1:{port}/messaging_pb.SeaweedS3IamCache/PutIdentity"
    words = ["curl", "-sS", "--include", "--http2-prior-knowledge", "--header", "content-type: application/grpc"]
    ran = subprocess.run([*words, "--data-binary", "@-", url], input=empty, capture_output=True, check=True)
    assert b"grpc-status: 16" in ran.stdout, "unauthenticated"


def test_the_comments_of_the_proxy_lead_to_a_login_over_tls(tmp_path: Path) -> None:
    with composition(tmp_path, without={"worker"}) as farm:
        printed = follow(farm, OVERRIDES / "proxy.yml")
        assert printed[LINK].startswith(f"https://localhost:{farm.ports['443']}/login?token=")
        authority = ssl.create_default_context(cafile=str(farm.clone / "root.crt"))
        with logged_in(printed[LINK].strip(), verify=authority) as browser:
            assert browser.get("/api/v1/session").json()["role"] == "admin"
            assert all(cookie.secure for cookie in browser.cookies.jar)
            assert "strict-transport-security" in browser.get("/").headers


def test_the_comments_of_monitoring_lead_to_figures_that_prometheus_may_read(tmp_path: Path) -> None:
    with composition(tmp_path, without={"worker"}) as farm:
        printed = follow(farm, OVERRIDES / "monitoring.yml")
        assert len(printed["sudo cat secrets/grafana.password"].strip()) == 64
        token = (farm.clone / "secrets/prometheus.token").read_text().strip()
        headers = {"Authorization": f"Bearer {token}"}
        assert "lippmann_workers" in httpx.get(f"{farm.url}/metrics", headers=headers).text
        assert httpx.get(f"{farm.url}/metrics").status_code == 401
