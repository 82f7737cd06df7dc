"""The farm and its workers, as text and as data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from lippmann.terminal.progress import duration_text, size_text, time_text, utc_text
from lippmann.terminal.table import fields, table

if TYPE_CHECKING:
    from service.schemas.farm import ComponentHealth, Health, StoreHealth, Worker
    from service.schemas.job import Job

_EPOCH_FIELDS = ("since_s", "started_s", "seen_s", "not_claiming_since_s", "opens_s")
"""The fields of the API that are times in seconds since 1970."""
COUNTED = 1000
"""The open jobs of each status that are counted, and the number above which there are just more."""


@dataclass(frozen=True)
class FarmState:
    """A farm at one moment."""

    url: str
    health: Health
    workers: tuple[Worker, ...] | None
    """The workers that are online; None if the broker does not answer."""
    jobs: Mapping[str, tuple[Job, ...]]
    """The open jobs by status, at most `COUNTED` + 1 of each."""


def status_text(farm: FarmState) -> str:
    """Return the state of a farm in some lines."""
    health = farm.health
    parts: dict[str, ComponentHealth | StoreHealth]
    parts = {"database": health.database, "broker": health.broker, "store": health.store}
    bad = [f"{name}: {part.detail}" for name, part in parts.items() if not part.ok]
    if not health.coordinator.ok:
        bad.append("coordinator: none runs, so no task is scheduled")
    free = health.store.free_bytes
    lines = fields(
        [
            ("farm", f"{farm.url}, version {health.version}"),
            ("health", health.status if not bad else f"{health.status}: {'; '.join(bad)}"),
            *(("fault", f"{one.message} (since {_epoch_text(one.since_s)})") for one in health.faults),
            *(("note", note) for note in health.notes),
            ("store", None if free is None else f"{size_text(free)} free"),
            ("workers", _workers_text(farm)),
            (
                "jobs",
                ", ".join(f"{_count_text(jobs)} {status}" for status, jobs in farm.jobs.items() if jobs) or "none",
            ),
        ]
    )
    first = [job for jobs in farm.jobs.values() for job in jobs][:5]
    return "\n".join([lines, *(f"        {_job_line(job)}" for job in first)])


def status_data(farm: FarmState) -> dict[str, Any]:
    """Return the state of a farm as data."""
    jobs = {status: len(jobs) for status, jobs in farm.jobs.items()}
    workers = None if farm.workers is None else workers_data(farm.workers)
    health = with_iso_times(farm.health.model_dump(mode="json"))
    return {"url": farm.url, "health": health, "workers": workers, "jobs": jobs}


def workers_data(workers: Iterable[Worker]) -> list[dict[str, Any]]:
    """Return workers as data."""
    return [with_iso_times(worker.model_dump(mode="json")) for worker in workers]


def with_iso_times(data: Any) -> Any:
    """Return data of the API with its times in ISO 8601, such as `seen_at` in place of `seen_s`.

    >>> with_iso_times({"seen_s": 0, "not_claiming_since_s": None, "cpu_s": 2})
    {'seen_at': '1970-01-01T00:00:00Z', 'not_claiming_since_at': None, 'cpu_s': 2}
    """
    if isinstance(data, dict):
        return dict(_iso(name, value) for name, value in data.items())
    return [with_iso_times(one) for one in data] if isinstance(data, list | tuple) else data


def _iso(name: str, value: Any) -> tuple[str, Any]:
    if name not in _EPOCH_FIELDS:
        return name, with_iso_times(value)
    return f"{name.removesuffix('_s')}_at", None if value is None else utc_text(value)


def _epoch_text(seconds: float) -> str:
    return time_text(datetime.fromtimestamp(seconds, UTC))


def _workers_text(farm: FarmState) -> str:
    if farm.workers is None:
        return "not known, because the broker does not answer"
    slots, busy = sum(one.slots for one in farm.workers), sum(one.running for one in farm.workers)
    idle = sum(takes_none(one) for one in farm.workers)
    text = f"{len(farm.workers)} online, {busy} of {slots} slots busy"
    return f"{text}; {idle} of them take no orders (`lippmann workers`)" if idle else text


def _count_text(jobs: tuple[Job, ...]) -> str:
    return f"more than {COUNTED}" if len(jobs) > COUNTED else str(len(jobs))


def _job_line(job: Job) -> str:
    left = f", {duration_text(job.eta_s)} to go" if job.eta_s is not None else ""
    waits = f", waits: {job.wait.code}" if job.wait is not None else ""
    return f"{job.id}  {job.status}, {job.progress:.0%}{left}{waits}"


WORKER_HEAD = ("name", "running", "orders", "tags", "sandbox", "host", "version")


def worker_table(workers: Iterable[Worker], *, now_s: float) -> str:
    """Return workers, one a line, with those that take no orders marked."""
    found = tuple(workers)
    if not found:
        return "No workers."
    notes = [f"note: {worker.version_note}" for worker in found if worker.version_note]
    return "\n".join([table(WORKER_HEAD, worker_rows(found, now_s=now_s)), *notes])


def worker_rows(workers: Iterable[Worker], *, now_s: float) -> list[tuple[str, ...]]:
    """Return the cells of workers, under `WORKER_HEAD`."""
    return [
        (
            worker.name,
            f"{worker.running}/{worker.slots}",
            _claiming_text(worker, now_s),
            ", ".join(filter(None, [worker.pool and f"pool {worker.pool}", *worker.tags])),
            "none: scenes of Lippmann only" if worker.sandbox == "none" else worker.sandbox,
            worker.host,
            worker.version,
        )
        for worker in workers
    ]


def takes_none(worker: Worker) -> bool:
    """Return whether a worker takes no orders now."""
    return any(one is not None for one in (worker.fault, worker.closed, worker.not_claiming_since_s))


def _claiming_text(worker: Worker, now_s: float) -> str:
    if worker.fault is not None:
        return worker.fault
    if worker.closed is not None:
        return _closed_text(worker)
    if worker.not_claiming_since_s is None:
        return "takes orders"
    return f"has taken none for {duration_text(now_s - worker.not_claiming_since_s)}"


def _closed_text(worker: Worker) -> str:
    if worker.closed == "draining":
        return f"draining, {worker.running} left" if worker.running else "drained"
    if worker.closed == "hours":
        return "outside its hours" + ("" if worker.opens_s is None else f" until {_epoch_text(worker.opens_s)}")
    return "none: of another version"
