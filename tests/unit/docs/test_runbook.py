"""What docs/runbook.md says: each alert has its section, and each command, file and object of Kubernetes exists."""

from __future__ import annotations

import re

import pytest
import typer.main
import yaml

from lippmann.cli.main import app
from tests.kustomize import build
from tests.repository import DOCS, ROOT

PAGE = (DOCS / "runbook.md").read_text()
BLOCKS = "\n".join(re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)).replace("\\\n", " ")


def test_every_alert_has_a_section_and_no_other() -> None:
    told = yaml.safe_load((ROOT / "deploy/monitoring/alerts.yml").read_text())
    alerts = {rule["alert"]: rule for group in told["groups"] for rule in group["rules"]}
    sections = PAGE.split("\n## Alerts\n")[1].split("\n### ")[1:]
    assert {section.split("\n")[0] for section in sections} == set(alerts)
    for section in sections:
        name, meaning, *to_do = [part for part in section.split("\n\n") if part]
        assert meaning
        assert to_do, f"{name}: what it means, and what to do"
    for name, rule in alerts.items():
        assert rule["annotations"]["runbook_url"].endswith(f"docs/runbook.md#{name.lower()}")


def test_every_command_inside_another_one_is_one_that_lippmann_has() -> None:
    commands = typer.main.get_group(app).commands
    found = re.findall(r"(?:-- |'|/bin/|`)lippmann ([a-z][a-z-]*)(?: ([a-z-]+))?", BLOCKS + PAGE)
    assert {"admin", "backup"} <= {word for words in found for word in words}
    for first, second in found:
        assert first in commands, first
        inner = getattr(commands[first], "commands", None)
        assert inner is None or not second or second in inner, second


def test_every_file_of_the_repository_is_there() -> None:
    made = {"deploy/kubernetes/secrets/make"}  # a program, which the text also calls with a word
    for path in set(re.findall(r"\bdeploy/[\w./-]+\w", PAGE)) | made:
        assert (ROOT / path).exists(), path


@pytest.mark.parametrize("overlay", ["small", "production"])
def test_every_object_of_kubernetes_is_in_the_manifests(overlay: str) -> None:
    objects = build(ROOT / "deploy/kubernetes/overlays" / overlay)
    there = {f"{each['kind'].lower()}/{each['metadata']['name']}" for each in objects}
    named = set(re.findall(r"\b(?:deployment|service)/[a-z-]+", BLOCKS))
    assert named == {"deployment/lippmann-service", "deployment/lippmann-worker", "service/lippmann-service"}
    assert named <= there
    assert set(re.findall(r"--namespace (\S+)", BLOCKS)) == {"lippmann"}


def test_every_file_that_a_host_gets_is_named_by_a_unit_or_an_example() -> None:
    units = "".join(path.read_text() for path in (ROOT / "deploy/systemd").glob("*.service"))
    files = re.findall(r"^\| (/etc/lippmann/[\w.-]+) \|", PAGE, re.MULTILINE)
    assert len(files) > 5
    for file in files:
        assert re.search(rf"={re.escape(file)}(?![\w.])", PAGE + units), file


def test_every_unit_of_systemd_is_there() -> None:
    named = set(re.findall(r"(?:enable --now|restart|status|--unit) (lippmann-[a-z]+)", PAGE))
    assert named == {path.stem for path in (ROOT / "deploy/systemd").glob("*.service")}
