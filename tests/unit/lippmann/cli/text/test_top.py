"""The text of `lippmann top`."""

from __future__ import annotations

from io import StringIO
from typing import Any

from rich.console import Console

from lippmann.cli.text.top import SHOWN, Sample, rates, top_data, top_screen, top_text
from lippmann.job.spec import JobSpec
from service.schemas.farm import ComponentHealth, CoordinatorHealth, Fault, Health, StoreHealth, WaitingWork, Worker
from service.schemas.job import FrameCount, Job, Size, TaskCounts
from service.schemas.wait import Wait, WaitCode
from tests.builders_service import T0

FINE = ComponentHealth(ok=True, detail="answers")
WORKER = Worker(
    name="w1", host="h", pid=1, slots=4, sandbox="bwrap", povray="3.7", version="1", started_s=0.0, seen_s=0.0,
    running=3, not_claiming_since_s=None,
)  # fmt: skip


def job(name: str, done: int, **more: Any) -> Job:
    counts = TaskCounts(waiting=1, ready=2, dispatched=0, running=3, done=done, failed=0, cancelled=0)
    given: dict[str, Any] = {
        "id": name, "title": name, "scene": "fish", "status": "running", "actions": (), "priority": 50,
        "owner": "ann", "created_at": T0, "started_at": None, "ended_at": None,
        "frames": FrameCount(text="1-3", count=3), "fps": 25.0,
        "size": Size(rows=8, cols=8, lens_rows=4, lens_cols=4, px_per_lens=2),
        "spec": JobSpec(scene="fish"), "notes": (), "error": None, "progress": 0.5, "eta_s": 61.0,
        "tasks": counts, "frames_done": 0, "frames_total": 3, "cpu_s": 0.0, "late_events": 0, "outputs": (),
    }  # fmt: skip
    return Job.model_validate({**given, **more})


def sample(at_s: float, *jobs: Job, ended: dict[str, int] | None = None, **health: Any) -> Sample:
    given: dict[str, Any] = {
        "status": "ok", "version": "1", "database": FINE, "broker": FINE, "workers": 1, "slots": 4,
        "store": StoreHealth(ok=True, detail="", free_bytes=5_000_000_000),
        "coordinator": CoordinatorHealth(ok=True, leader="a"),
    }  # fmt: skip
    work = WaitingWork(waiting_tasks=20, running_tasks=3, wanted_slots=9)
    return Sample("http://farm", at_s, Health(**given | health), (WORKER,), work, jobs, ended or {})


def test_rates_are_those_of_the_jobs_that_were_open_before() -> None:
    before = sample(10.0, job("a", 4), job("b", 9), job("gone", 1), job("repaired", 8))
    now = sample(14.0, job("a", 12), job("new", 100), job("repaired", 6), ended={"b": 11})
    assert rates(before, now) == {"a": 2.0, "b": 0.5, "repaired": 0.0}
    assert rates(None, now) == rates(now, now) == {}


def test_the_text_names_slots_rates_waits_and_workers() -> None:
    wait = Wait(code=WaitCode.NO_WORKER, message="")
    fault = Fault(component="store", code="store-full", message="No room.", since_s=0.0)
    before = sample(10.0, job("a", 4))
    text = top_text(before, sample(12.0, job("a", 9), job("b", 0, wait=wait), faults=(fault,)), now_s=T0)
    lines = text.splitlines()
    assert lines[:7] == [
        "farm     http://farm, ok",
        "fault    No room.",
        "workers  1 online",
        "slots    3 of 4 busy, 9 wanted",
        "tasks    20 wait for a slot, 2.5 done a second",
        "jobs     2 running",
        "store    5.0 GB free",
    ]
    assert lines[8].split() == ["JOB", "STATUS", "PRIORITY", "DONE", "TASKS", "TASKS/S", "LEFT", "WAITS", "TITLE"]
    assert lines[9].split()[:6] == ["a", "running", "50", "50%", "9/15", "2.5"]
    assert lines[10].split()[5:11] == ["-", "1", "min", "01", "s", "no-worker"]
    assert lines[-1].split()[:4] == ["w1", "3/4", "takes", "orders"]


def test_what_is_not_known_is_said_and_many_jobs_are_not_counted() -> None:
    away = sample(10.0, *(job(f"j{number}", 0) for number in range(SHOWN)), slots=None)
    text = top_text(None, Sample(**{**vars(away), "workers": None}), now_s=T0)
    assert "workers  not known, because the broker does not answer" in text
    assert "3 of ? busy" in text
    assert "done a second" not in text
    assert f"{SHOWN} or more running" in text


def test_the_data_has_rates_as_numbers_or_null() -> None:
    before = sample(10.0, job("a", 4))
    data = top_data(before, sample(12.0, job("a", 9), job("b", 0)))
    assert (data["tasks_per_s"], data["wanted_slots"], data["slots"], data["status"]) == (2.5, 9, 4, "ok")
    assert [(one["id"], one["tasks_per_s"]) for one in data["jobs"]] == [("a", 2.5), ("b", None)]
    assert top_data(None, before)["tasks_per_s"] is None


def test_the_screen_obeys_nothing_that_a_title_says() -> None:
    drawn = StringIO()
    console = Console(file=drawn, width=200, force_terminal=True)
    console.print(top_screen(None, sample(1.0, job("a", 1, title="[red]x\x1b[2J[/red]")), now_s=T0))
    assert "[red]x [2J[/red]" in drawn.getvalue()
    assert "\x1b[2J" not in drawn.getvalue()
