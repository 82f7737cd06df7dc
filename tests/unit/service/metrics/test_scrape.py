"""The text of a scrape, from what a farm says."""

from __future__ import annotations

from lippmann.job.messages.events import PresenceFault
from service.metrics.readings import FarmReading, StoreReading, read_database
from service.metrics.scrape import scrape_text
from service.roster import Roster
from tests.builders_service import T0, Farm, owner, presence
from tests.scraping import Scrape

HOST = "host-of-a-worker"
FAULT = PresenceFault(code="disk-full", message="no room")


def reading(farm: Farm) -> FarmReading:
    """Return a farm with a worker that works, and with others that are deaf, faulty, drained and out of hours."""
    workers = [
        presence("able", 2),
        presence("deaf", 4),
        presence("faulty", 8).model_copy(update={"fault": FAULT, "host": HOST}),
        presence("drained", 16).model_copy(update={"closed": "draining"}),
        presence("asleep", 32).model_copy(update={"closed": "hours", "version": "older"}),
    ]
    roster = Roster(tuple(workers), {"deaf": T0})
    return FarmReading(T0, read_database(farm.database, ended={}), roster, StoreReading(free_bytes=9, free_files=7))


def test_workers_and_slots_are_counted_by_their_state(farm: Farm) -> None:
    found = Scrape(scrape_text(reading(farm), farm.settings, streams=3).decode())
    states = {state: found("lippmann_workers", state=state) for state in ("online", "deaf", "faulty", "closed")}
    assert states == {"online": 5, "deaf": 1, "faulty": 1, "closed": 2}
    slots = {state: found("lippmann_slots", state=state) for state in ("total", "busy", "draining")}
    assert slots == {"total": 10, "busy": 0, "draining": 16}
    assert found("lippmann_workers_by_version", version="older") == 1
    assert (found("lippmann_store_free_bytes"), found("lippmann_store_free_inodes")) == (9, 7)
    assert found("lippmann_event_streams") == 3
    assert found("lippmann_component_ok", component="coordinator") == found("lippmann_leader") == 0


def test_the_figures_name_no_job_no_owner_and_no_host(farm: Farm) -> None:
    job_id = farm.planned(caller=owner("an-owner"), title="a title")
    text = scrape_text(reading(farm), farm.settings, streams=0).decode()
    assert 'lippmann_jobs{status="running"} 1.0' in text
    assert not [word for word in (job_id, "an-owner", "a title", HOST, "able") if word in text]
