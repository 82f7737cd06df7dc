"""The text of `lippmann top`: a farm at one moment, and the rates between two of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any

from lippmann.cli.text.farm import WORKER_HEAD, takes_none, worker_rows, worker_table, workers_data
from lippmann.job.states import JobStatus
from lippmann.terminal.progress import duration_text, size_text
from lippmann.terminal.table import cell, fields, table

if TYPE_CHECKING:
    from rich.console import Group

    from lippmann.client import Client
    from service.schemas.farm import Health, WaitingWork, Worker
    from service.schemas.job import Job

SHOWN = 50
"""The largest number of open jobs of each status that are shown."""
STATUSES = (JobStatus.RUNNING, JobStatus.PROBING, JobStatus.PAUSED, JobStatus.QUEUED)
_TITLE = 30


@dataclass(frozen=True)
class Sample:
    """A farm at one moment."""

    url: str
    at_s: float
    """The time of a clock that is never set, in seconds."""
    health: Health
    workers: tuple[Worker, ...] | None
    """The workers that are online; None if the broker does not answer."""
    work: WaitingWork
    jobs: tuple[Job, ...]
    """Open jobs, at most `SHOWN` of each status."""
    ended: Mapping[str, int]
    """The number of done tasks of the jobs that have ended since the sample before, by job."""


def sample(client: Client, before: Sample | None, *, at_s: float) -> Sample:
    """Return what a farm says now."""
    workers = client.workers()
    jobs = tuple(job for status in STATUSES for job in islice(client.jobs(status=status, limit=SHOWN), SHOWN))
    open_ids = {job.id for job in jobs}
    gone = [job.id for job in before.jobs if job.id not in open_ids] if before is not None else []
    ended = {job_id: count for job_id in gone if (count := _done_at_end(client, job_id)) is not None}
    return Sample(
        client.address.url, at_s, client.health(), workers.items if workers.known else None, client.waiting(), jobs,
        ended,
    )  # fmt: skip


def rates(before: Sample | None, now: Sample) -> dict[str, float]:
    """Return the tasks a second that were done between two samples, of the jobs that were open in the first, by job."""
    if before is None or now.at_s <= before.at_s:
        return {}
    done = {**now.ended, **{job.id: job.tasks.done for job in now.jobs}}
    # What a repair takes back is no work that was done.
    return {
        job.id: max(0, done[job.id] - job.tasks.done) / (now.at_s - before.at_s)
        for job in before.jobs
        if job.id in done
    }


def top_data(before: Sample | None, now: Sample) -> dict[str, Any]:
    """Return a farm at one moment as data; rates are null without a sample before."""
    rate = rates(before, now)
    jobs = [
        {
            "id": job.id, "title": job.title, "status": str(job.status), "priority": job.priority,
            "progress": job.progress, "tasks": job.tasks.model_dump(mode="json"),
            "tasks_per_s": rate.get(job.id), "eta_s": job.eta_s,
            "wait": None if job.wait is None else str(job.wait.code),
        }
        for job in now.jobs
    ]  # fmt: skip
    return {
        "url": now.url,
        "status": now.health.status,
        "faults": [fault.message for fault in now.health.faults],
        **now.work.model_dump(mode="json"),
        "slots": now.health.slots,
        "tasks_per_s": sum(rate.values()) if before is not None else None,
        "workers": None if now.workers is None else workers_data(now.workers),
        "jobs": jobs,
    }


def top_text(before: Sample | None, now: Sample, *, now_s: float) -> str:
    """Return a farm at one moment as lines of text."""
    jobs = table(JOB_HEAD, job_rows(before, now)) if now.jobs else ""
    workers = worker_table(now.workers or (), now_s=now_s)
    return "\n\n".join(part for part in (fields(summary(before, now)), jobs, workers) if part)


def top_screen(before: Sample | None, now: Sample, *, now_s: float) -> Group:
    """Return a farm at one moment as tables for a terminal, which are cut where it ends."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    def made(head: Sequence[str], rows: Sequence[Sequence[object]]) -> Table:
        drawn = Table(box=None, pad_edge=False, header_style="bold", expand=False)
        for name in head:
            drawn.add_column(name.upper(), no_wrap=True)
        for row in rows:
            # Titles come from other users: no markup, no control characters.
            drawn.add_row(*(Text(cell(value)) for value in row))
        return drawn

    parts: list[Text | Table] = [Text(fields(summary(before, now))), Text()]
    if now.jobs:
        parts += [made(JOB_HEAD, job_rows(before, now)), Text()]
    return Group(*parts, made(WORKER_HEAD, worker_rows(now.workers or (), now_s=now_s)))


def summary(before: Sample | None, now: Sample) -> list[tuple[str, str | None]]:
    """Return the first lines of the picture of a farm, as names and values."""
    work, health = now.work, now.health
    open_jobs = ", ".join(f"{count} {status}" for status in STATUSES if (count := _count(now, status)))
    rate = sum(rates(before, now).values()) if before is not None else None
    free = health.store.free_bytes
    online = "not known, because the broker does not answer" if now.workers is None else f"{len(now.workers)} online"
    deaf = sum(map(takes_none, now.workers or ()))
    return [
        ("farm", f"{now.url}, {health.status}"),
        *(("fault", fault.message) for fault in health.faults),
        ("workers", online + (f", {deaf} take no orders" if deaf else "")),
        (
            "slots",
            f"{work.running_tasks} of {'?' if health.slots is None else health.slots} busy, {work.wanted_slots} wanted",
        ),
        (
            "tasks",
            f"{work.waiting_tasks} wait for a slot" + (f", {rate:.1f} done a second" if rate is not None else ""),
        ),
        ("jobs", open_jobs or "none"),
        ("store", None if free is None else f"{size_text(free)} free"),
    ]


JOB_HEAD = ("job", "status", "priority", "done", "tasks", "tasks/s", "left", "waits", "title")


def job_rows(before: Sample | None, now: Sample) -> Sequence[tuple[object, ...]]:
    """Return the cells of the open jobs, under `JOB_HEAD`."""
    rate = rates(before, now)
    return [
        (
            job.id, str(job.status), job.priority, f"{job.progress:.0%}", f"{job.tasks.done}/{_tasks(job)}",
            f"{rate[job.id]:.1f}" if job.id in rate else None,
            duration_text(job.eta_s) if job.eta_s is not None else None,
            None if job.wait is None else str(job.wait.code),
            job.title if len(job.title) <= _TITLE else f"{job.title[: _TITLE - 3]}...",
        )
        for job in now.jobs
    ]  # fmt: skip


def _tasks(job: Job) -> int:
    return sum(job.tasks.model_dump().values())


def _count(now: Sample, status: JobStatus) -> str:
    count = sum(job.status is status for job in now.jobs)
    return f"{SHOWN} or more" if count >= SHOWN else str(count or "")


def _done_at_end(client: Client, job_id: str) -> int | None:
    """Return the done tasks of a job that is open no longer; None if it was removed."""
    from lippmann.client.errors import Refused

    try:
        return client.job(job_id).tasks.done
    except Refused:
        return None
