"""The Secrets of deploy/kubernetes: each is made, described, and used."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import yaml

from lippmann.key_file import read_keys, read_secret
from tests.kustomize import Thing, build
from tests.repository import DOCS, ROOT
from tests.rules.test_kubernetes import HERE, in_every_overlay, objects


def made(overlay: str) -> dict[str, set[str]]:
    """Return the keys of the Secrets that are made for an overlay."""
    found: dict[str, set[str]] = {}
    for part in ("farm", "small") if overlay == "small" else ("farm",):
        told = yaml.safe_load((HERE / f"secrets/{part}/kustomization.yaml").read_text())
        found |= {each["name"]: {key.partition("=")[0] for key in each["files"]} for each in told["secretGenerator"]}
    return found


def secrets_used(overlay: str) -> dict[str, set[str]]:
    """Return the keys that an overlay takes of each Secret; none if it takes the whole of it."""
    used: dict[str, set[str]] = {}
    for each in walk(objects(overlay)):
        if "secretKeyRef" in each:
            used.setdefault(each["secretKeyRef"]["name"], set()).add(each["secretKeyRef"]["key"])
        if isinstance(each.get("secret"), dict):
            name = each["secret"].get("name") or each["secret"]["secretName"]
            used.setdefault(name, set()).update(item["key"] for item in each["secret"].get("items", []))
        for target in each.get("secretTargetRef", []):
            used.setdefault(target["name"], set()).add(target["key"])
    return used


def walk(found: Any) -> Iterator[Thing]:
    if isinstance(found, dict):
        yield found
    for value in found.values() if isinstance(found, dict) else found if isinstance(found, list) else ():
        yield from walk(value)


@in_every_overlay
def test_every_secret_is_made_or_described_in_the_runbook(overlay: str) -> None:
    page = (DOCS / "runbook.md").read_text()
    found = made(overlay)
    for name, keys in secrets_used(overlay).items():
        assert f"`{name}`" in page, name
        assert keys <= found[name], name
    assert set(secrets_used(overlay)) == set(found), "no Secret is made that nothing uses"


def test_make_writes_every_file_of_the_secrets(tmp_path: Path) -> None:
    shutil.copytree(
        ROOT / "deploy", tmp_path / "deploy", ignore=shutil.ignore_patterns("*.key", "*.password", "*.url", "s3-*")
    )
    folder = tmp_path / "deploy/kubernetes/secrets"
    ran = subprocess.run([folder / "make"], capture_output=True, text=True, check=False)
    assert (ran.returncode, "farm/database.url, which docs/runbook.md describes" in ran.stderr) == (1, True), (
        "these are the operator's to write"
    )
    subprocess.run([folder / "make", "small"], check=True)
    for part in ("farm", "small"):
        build(folder / part)  # refuses a file that is not there
    farm = folder / "farm"
    assert [len(read_keys(farm / name)) for name in ("order.key", "link.key")] == [1, 1]
    assert all(read_secret(path) for path in farm.glob("*.password"))
    url = urlsplit((farm / "database.url").read_text())
    assert (url.scheme, url.username, url.hostname, url.path) == ("postgresql+psycopg", "lippmann", "database", "/farm")
    assert url.password == (folder / "small/database.password").read_text().strip()
    for name in ("database.url", "metrics.token"):  # a variable and a header have no line break
        assert "\n" not in (farm / name).read_text(), name
    (user,) = json.loads((folder / "small/store-users.json").read_text())["identities"]
    (keys,) = user["credentials"]
    assert f"aws_secret_access_key = {keys['secretKey']}\n" in (farm / "s3-keys").read_text()
    written = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    subprocess.run([folder / "make", "small"], check=True)
    assert {path: path.read_bytes() for path in written} == written, "what exists is kept"


def test_what_make_writes_stays_out_of_the_repository() -> None:
    lines = (HERE / "secrets/.gitignore").read_text().splitlines()
    kept = {line.removeprefix("!").rstrip("/") for line in lines if line.startswith("!")}
    assert "*" in lines
    assert kept == {".gitignore", "make", "farm", "small", "kustomization.yaml"}
