"""The farm as text and as data."""

from __future__ import annotations

from lippmann.cli.text.farm import FarmState, status_data, status_text, worker_table, workers_data
from service.schemas.farm import ComponentHealth, CoordinatorHealth, Fault, Health, StoreHealth, Worker


def _worker(sandbox: str) -> Worker:
    return Worker(
        name="w1", host="h", pid=1, slots=2, sandbox=sandbox, povray="3.7", version="1", started_s=0.0, seen_s=0.0,
        running=1, not_claiming_since_s=None,
    )  # fmt: skip


def test_the_sandbox_of_every_worker_is_shown() -> None:
    lines = worker_table([_worker("bwrap"), _worker("none")], now_s=1.0).splitlines()
    assert ["SANDBOX" in lines[0], "bwrap" in lines[1], "none: scenes of Lippmann only" in lines[2]] == [True] * 3


def test_the_list_says_why_a_worker_takes_no_orders_and_which_jobs_it_does() -> None:
    note = "w1 runs Lippmann 1, this service 2: upgrade the older one."
    workers = [
        _worker("bwrap").model_copy(update=changes)
        for changes in (
            {"closed": "draining", "pool": "night", "tags": ("big", "gpu")},
            {"closed": "draining", "running": 0},
            {"closed": "hours", "opens_s": 0.0},
            {"closed": "version", "version_note": note},
        )
    ]
    lines = worker_table(workers, now_s=1.0).splitlines()
    assert "draining, 1 left" in lines[1]
    assert "pool night, big, gpu" in lines[1]
    assert "drained" in lines[2]
    assert "outside its hours until " in lines[3]
    assert "none: of another version" in lines[4]
    assert lines[5] == f"note: {note}"


def test_times_of_workers_are_iso_8601_and_durations_stay_numbers() -> None:
    (data,) = workers_data([_worker("bwrap").model_copy(update={"not_claiming_since_s": 86_400.5})])
    assert data["seen_at"] == data["started_at"] == "1970-01-01T00:00:00Z"
    assert data["not_claiming_since_at"] == "1970-01-02T00:00:00Z"
    assert not [name for name in data if name.endswith("_s")]


def test_the_state_of_a_farm_fits_some_lines_and_names_what_does_not_work() -> None:
    fine = ComponentHealth(ok=True, detail="answers")
    health = Health(
        status="degraded", version="1.2", database=fine, broker=ComponentHealth(ok=False, detail="ConnectionError"),
        store=StoreHealth(ok=True, detail="answers", free_bytes=5_000_000_000),
        coordinator=CoordinatorHealth(ok=False, leader=None), workers=1, slots=2,
        faults=(Fault(component="store", code="store-full", message="No room is left.", since_s=0.0),),
    )  # fmt: skip
    farm = FarmState("http://farm", health, (_worker("bwrap").model_copy(update={"fault": "no POV-Ray"}),), {})
    lines = status_text(farm).splitlines()
    assert lines[0].endswith("http://farm, version 1.2")
    assert "degraded: broker: ConnectionError; coordinator: none runs" in lines[1]
    assert "No room is left. (since 19" in lines[2]
    assert lines[3].endswith("5.0 GB free")
    assert "1 online, 1 of 2 slots busy; 1 of them take no orders" in lines[4]
    assert lines[5].split() == ["jobs", "none"]
    data = status_data(farm)
    assert (data["health"]["faults"][0]["since_at"], data["jobs"]) == ("1970-01-01T00:00:00Z", {})
    assert data["workers"][0]["fault"] == "no POV-Ray"
