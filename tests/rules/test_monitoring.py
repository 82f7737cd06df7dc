"""The alerts say what is wrong and what to do, and fire when they must; the last needs promtool."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.repository import DOCS, ROOT

MONITORING = ROOT / "deploy/monitoring"
ALERTS = MONITORING / "alerts.yml"
RULES: dict[str, dict[str, Any]] = {
    rule["alert"]: rule for rule in yaml.safe_load(ALERTS.read_text())["groups"][0]["rules"]
}

SERIES: dict[str, tuple[dict[str, str], dict[str, str]]] = {
    "LippmannServiceDown": ({'up{job="lippmann"}': "0x30"}, {'up{job="lippmann"}': "1x30"}),
    "LippmannDatabaseAway": (
        {'lippmann_component_ok{component="database"}': "0x30", 'lippmann_component_ok{component="broker"}': "1x30"},
        {'lippmann_component_ok{component="database"}': "1x30", 'lippmann_component_ok{component="broker"}': "0x30"},
    ),
    "LippmannBrokerAway": (
        {'lippmann_component_ok{component="broker",instance="a"}': "0x30",
         'lippmann_component_ok{component="broker",instance="b"}': "1x30"},
        {'lippmann_component_ok{component="broker"}': "1x30"},
    ),
    "LippmannNoLeader": ({"lippmann_leader": "0x30"}, {"lippmann_leader": "1 0 1x28"}),
    "LippmannNoWorkers": (
        {'lippmann_workers{state="online"}': "2x30", 'lippmann_slots{state="total"}': "0x30",
         "lippmann_waiting_tasks": "3x30"},
        {'lippmann_workers{state="online"}': "0x30", "lippmann_waiting_tasks": "0x30"},
    ),
    "LippmannWaitingTooLong": (
        {"lippmann_oldest_queued_job_age_seconds": "3500+60x30"}, {"lippmann_oldest_queued_job_age_seconds": "0+60x30"}
    ),
    "LippmannStoreFull": (
        {"lippmann_store_free_bytes": "4e9x30", "lippmann_store_reserve_bytes": "5e7x30"},
        {"lippmann_store_free_bytes": "4e11x30", "lippmann_store_reserve_bytes": "5e7x30",
         "lippmann_store_free_inodes": "1e6x30"},
    ),
    "LippmannFault": (
        {'lippmann_fault{component="broker",code="broker-evicts"}': "1x30"},
        {'lippmann_fault{component="store",code="store-full"}': "1x30",
         'lippmann_component_ok{component="store"}': "1x30"},
    ),
    "LippmannAttemptsLost": (
        {'lippmann_attempts_total{outcome="lost",instance="a"}': "0+0.5x30",
         'lippmann_attempts_total{outcome="lost",instance="b"}': "0x30"},
        {'lippmann_attempts_total{outcome="lost"}': "9x30", 'lippmann_attempts_total{outcome="failed"}': "0+9x30"},
    ),
    "LippmannWorkerDeaf": (
        {'lippmann_workers{state="deaf"}': "1x30"},
        {'lippmann_workers{state="deaf"}': "0x30", 'lippmann_workers{state="online"}': "9x30"},
    ),
    "LippmannWebhooksFailing": (
        {'lippmann_webhook_attempts_total{result="given-up"}': "0 0 1x28"},
        {'lippmann_webhook_attempts_total{result="failed"}': "0+1x30",
         'lippmann_webhook_messages{state="retried"}': "2x30"},
    ),
}  # fmt: skip
"""For each alert, what a farm says each minute with which it fires, and with which it does not."""


def test_every_alert_has_a_sentence_a_description_and_a_section_of_the_runbook() -> None:
    for name, rule in RULES.items():
        assert rule["labels"]["severity"] in ("critical", "warning")
        assert set(rule["annotations"]) == {"summary", "description", "runbook_url"}
        assert all(rule["annotations"][field].endswith(".") for field in ("summary", "description"))
        assert rule["annotations"]["runbook_url"] == f"docs/runbook.md#{name.lower()}"


def test_the_alerts_are_documented_and_tried() -> None:
    page = (DOCS / "monitoring.md").read_text()
    assert re.findall(r"^\| `(Lippmann\w+)` \|", page, re.MULTILINE) == [*RULES]
    assert set(SERIES) == set(RULES)


def test_the_alerts_fire_when_they_must_and_only_then(tmp_path: Path) -> None:
    promtool = shutil.which("promtool")
    if promtool is None:
        pytest.skip("needs promtool, of Debian's package `prometheus`")
    tests = [_test(name, series, fires=fires) for name, both in SERIES.items() for fires, series in _pairs(both)]
    file = tmp_path / "tests.yml"
    file.write_text(yaml.safe_dump({"rule_files": [str(ALERTS)], "tests": tests}))
    ran = subprocess.run([promtool, "test", "rules", str(file)], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    config = tmp_path / "prometheus.yml"
    text = (MONITORING / "prometheus.yml").read_text().replace("/run/secrets/metrics-token", str(file))
    config.write_text(text.replace("alerts.yml", str(ALERTS)))
    ran = subprocess.run([promtool, "check", "config", str(config)], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr


def _pairs(both: tuple[dict[str, str], dict[str, str]]) -> list[tuple[bool, dict[str, str]]]:
    return [(True, both[0]), (False, both[1])]


def _test(name: str, series: dict[str, str], *, fires: bool) -> dict[str, Any]:
    query = f'count(ALERTS{{alertname="{name}",alertstate="firing"}}) or vector(0)'
    return {
        "name": f"{name} {'fires' if fires else 'does not fire'}",
        "interval": "1m",
        "input_series": [{"series": each, "values": values} for each, values in series.items()],
        "promql_expr_test": [
            {"expr": query, "eval_time": "20m", "exp_samples": [{"labels": "{}", "value": float(fires)}]}
        ],
    }
