"""What Prometheus and an autoscaler read of a real farm, and that alerts, board and docs name nothing else."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
import yaml

from service.schemas.farm import WaitingWork
from tests.farm import ended
from tests.integration.lippmann.conftest import Up, run
from tests.integration.lippmann.test_commands import SMALL
from tests.needs import needs_povray
from tests.repository import DOCS, ROOT
from tests.scraping import Scrape
from tests.waiting import until

MONITORING = ROOT / "deploy/monitoring"
BOARD = MONITORING / "grafana/dashboards/lippmann.json"
FOLLOWS_S = 5.0
"""The time within which the figure of an autoscaler follows the waiting work."""
OF_PROMETHEUS = {"up"}
"""The metrics that Prometheus itself makes of a scrape."""
_SELECTOR = re.compile(r"\b((?:lippmann|process)_\w+|up)(?:\{([^}]*)\})?")
_LABEL = re.compile(r'(\w+)="([^"]*)"')
_SUFFIX = re.compile(r"_(bucket|sum|count)$")


@pytest.fixture(scope="module")
def http(farm: Up) -> Iterator[httpx.Client]:
    headers = {"Authorization": f"Bearer {farm.address.key}"}
    with httpx.Client(base_url=farm.address.url, headers=headers, timeout=30) as client:
        yield client


@pytest.fixture(scope="module")
def scrape(http: httpx.Client) -> Scrape:
    """Return what a farm with a worker says."""

    def read() -> Scrape | None:
        found = Scrape(http.get("/metrics").text)
        return found if found.values.get(("lippmann_workers", frozenset({("state", "online")}))) else None

    found: Scrape = until(read)
    return found


def queries() -> Iterator[tuple[str, str]]:
    """Yield the queries of the alerts and of the board, with the names of those that have them."""
    (group,) = yaml.safe_load((MONITORING / "alerts.yml").read_text())["groups"]
    yield from ((rule["alert"], rule["expr"]) for rule in group["rules"])
    for panel in json.loads(BOARD.read_text())["panels"]:
        yield from ((panel["title"], target["expr"]) for target in panel["targets"])


@pytest.mark.parametrize(("owner", "query"), [*queries()])
def test_alerts_and_board_ask_for_what_a_farm_says(scrape: Scrape, owner: str, query: str) -> None:
    families = {family.name for family in scrape.families}
    used = _SELECTOR.findall(query)
    assert used
    for name, selector in used:
        if name in OF_PROMETHEUS:
            continue
        assert name in scrape.names | families, f"{owner}: a farm has no {name}"
        said = [dict(labels) for one, labels in scrape.values if one == name]
        for label, value in _LABEL.findall(selector):
            if said and label != "job":  # which Prometheus adds
                assert value in {labels.get(label) for labels in said}, f"{owner}: {name} has no {label}={value}"


def test_the_page_lists_every_metric_and_no_other(scrape: Scrape) -> None:
    page = (DOCS / "monitoring.md").read_text()
    listed = {
        name
        for row in re.findall(r"^\| (`lippmann_[^|]*) \|", page, re.MULTILINE)
        for name in re.findall(r"`(\w+)`", row)
    }
    said = {_SUFFIX.sub("", name) for name in scrape.names} | {"lippmann_fault"}
    assert listed == {name for name in said if name.startswith("lippmann_")}


def test_a_farm_that_is_well_says_so(scrape: Scrape) -> None:
    parts = ("database", "broker", "store", "coordinator")
    assert [scrape("lippmann_component_ok", component=part) for part in parts] == [1, 1, 1, 1]
    assert scrape("lippmann_workers", state="deaf") == scrape("lippmann_workers", state="faulty") == 0
    assert scrape("lippmann_slots", state="total") == 2
    assert scrape("lippmann_leader") == 1
    assert scrape("lippmann_leader_age_seconds") < 10
    assert scrape("lippmann_store_free_bytes") > scrape("lippmann_store_reserve_bytes") > 0


def test_top_shows_the_farm_once_as_text_and_as_json(farm: Up, scrape: Scrape) -> None:
    once = ("top", "--once", "--interval", "0.5", "--data-dir", str(farm.data_dir))
    text, data = run(*once), run(*once, "--json")
    assert (text.returncode, data.returncode) == (0, 0), text.stderr + data.stderr
    assert "1 online" in text.stdout
    found = json.loads(data.stdout)
    assert (found["slots"], len(found["workers"]), found["tasks_per_s"]) == (2, 1, 0.0)
    assert scrape("lippmann_workers", state="online") == 1


@needs_povray
def test_the_figure_of_an_autoscaler_follows_the_work(farm: Up, http: httpx.Client) -> None:
    def work() -> WaitingWork:
        return WaitingWork.model_validate(http.get("/api/v1/waiting").json())

    until(lambda: work().wanted_slots == 0)
    job: dict[str, Any] = {**SMALL, "frames": "1-2", "outputs": []}
    with farm.client() as client:
        job_id = client.submit(job).id
        begun_s = time.monotonic()
        until(lambda: work().wanted_slots > 0)
        assert time.monotonic() - begun_s < FOLLOWS_S
        assert ended(client, job_id).status == "done"
        begun_s = time.monotonic()
        until(lambda: work() == WaitingWork(waiting_tasks=0, running_tasks=0, wanted_slots=0))
        assert time.monotonic() - begun_s < FOLLOWS_S
    done = Scrape(http.get("/metrics").text)
    assert done("lippmann_attempts_total", outcome="done") >= 5  # a probe, and two frames rendered and assembled
    assert done("lippmann_orders_sent_total") >= 5
