"""A reading of the farm as metrics of Prometheus; docs/monitoring.md lists them. Pure.

What is not known has no value: the figures of a database that does not answer are left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily
from prometheus_client.metrics_core import Metric

from lippmann.job.messages.events import Closed
from lippmann.job.states import JobStatus
from service.db.jobs import SCHEDULABLE
from service.metrics.readings import DatabaseReading, FarmReading, StoreReading
from service.metrics.waiting import waiting_work, waiting_work_by_engine
from service.roster import Roster
from service.settings import Settings

PRIORITIES = (("low", 0), ("normal", 34), ("high", 67))
"""The classes of priorities, and the least priority of each; that of a job file without one is 50."""


def families(reading: FarmReading, settings: Settings) -> Iterator[Metric]:
    """Yield the metrics of a reading."""
    database, roster, store = reading.database, reading.roster, reading.store
    parts = {"database": database is not None, "broker": roster is not None, "store": store is not None}
    if database is not None:
        parts["coordinator"] = _leads(database, reading.at_s)
    yield _by_label("lippmann_component_ok", "1 if a component answers, else 0.", "component", parts)
    if database is not None:
        yield from _of_jobs(database, settings, now_s=reading.at_s)
        yield from _of_service(database, settings, now_s=reading.at_s)
    if roster is not None:
        yield from _of_workers(roster)
    if roster is not None and database is not None:
        busy = sum(running for *_, running in database.tasks)
        draining = sum(worker.slots for worker in roster.present if worker.closed == Closed.DRAINING)
        slots = {"total": roster.slots, "busy": busy, "draining": draining}
        yield _by_label(
            "lippmann_slots",
            "Slots of the workers that take orders, those with a task, and those of workers that are drained.",
            "state",
            slots,
        )
    if store is not None:
        yield from _of_store(store, settings)


def priority_class(priority: int) -> str:
    """Return the class of a priority.

    >>> priority_class(50), priority_class(67)
    ('normal', 'high')
    """
    return [name for name, least in PRIORITIES if priority >= least][-1]


def _of_jobs(database: DatabaseReading, settings: Settings, *, now_s: float) -> Iterator[Metric]:
    jobs = {status.value: database.jobs.get(status, 0) for status in JobStatus}
    yield _by_label("lippmann_jobs", "Jobs by status.", "status", jobs)
    tasks: Counter[tuple[str, str]] = Counter()
    for status, priority, waiting, ready, dispatched, running in database.tasks:
        name, is_paused = priority_class(priority), status not in SCHEDULABLE
        tasks["paused" if is_paused else "waiting", name] += waiting
        tasks["paused" if is_paused else "ready", name] += ready
        tasks["dispatched", name] += dispatched
        tasks["running", name] += running
    family = GaugeMetricFamily(
        "lippmann_tasks", "Tasks of open jobs, by status and class of priority.", labels=("status", "priority")
    )
    for status_name in ("waiting", "ready", "dispatched", "running", "paused"):
        for name, _ in PRIORITIES:
            family.add_metric((status_name, name), tasks[status_name, name])
    yield family
    work = waiting_work(database.wanted, max_slots=settings.max_slots)
    yield _gauge("lippmann_waiting_tasks", "Tasks that wait for a slot and nothing else.", work.waiting_tasks)
    yield _gauge("lippmann_wanted_slots", "Slots that would have work now.", work.wanted_slots)
    by_engine = waiting_work_by_engine(database.wanted, max_slots=settings.max_slots)
    waits = {engine: part.waiting_tasks for engine, part in by_engine.items()}
    yield _by_label("lippmann_engine_waiting_tasks", "Those tasks by the engine that they need.", "engine", waits)
    wants = {engine: part.wanted_slots for engine, part in by_engine.items()}
    yield _by_label("lippmann_engine_wanted_slots", "Those slots by the engine that they need.", "engine", wants)
    oldest_s = database.oldest_queued_s
    age_s = 0.0 if oldest_s is None else max(0.0, now_s - oldest_s)
    yield _gauge("lippmann_oldest_queued_job_age_seconds", "The age of the oldest job that has not begun.", age_s)
    yield _gauge("lippmann_artifact_bytes", "Bytes of the artifacts of all jobs.", database.artifact_bytes)


def _of_service(database: DatabaseReading, settings: Settings, *, now_s: float) -> Iterator[Metric]:
    yield _gauge("lippmann_leader", "1 if some process leads, else 0.", _leads(database, now_s))
    if database.leader is not None:
        age_s = max(0.0, now_s - (database.leader_until_s - settings.leader_ttl_s))
        yield _gauge("lippmann_leader_age_seconds", "The time since the leader renewed its leadership.", age_s)
    faults = GaugeMetricFamily(
        "lippmann_fault", "1 for each cause that prevents all work now.", labels=("component", "code")
    )
    for component, code in sorted({(fault.component, fault.code) for fault in database.faults}):
        faults.add_metric((component, code), 1)
    yield faults
    dropped = CounterMetricFamily(
        "lippmann_messages_dropped", "Messages of workers that were refused, by kind.", labels=("kind",)
    )
    for kind in ("event", "presence", "lease"):
        dropped.add_metric((kind,), database.dropped.get(kind, 0))
    yield dropped
    new, retried = database.webhooks
    yield _by_label(
        "lippmann_webhook_messages", "Messages that are not delivered yet.", "state", {"new": new, "retried": retried}
    )


def _of_workers(roster: Roster) -> Iterator[Metric]:
    deaf = sum(worker.name in roster.not_claiming for worker in roster.present)
    faulty = sum(worker.fault is not None for worker in roster.present)
    closed = sum(worker.closed is not None for worker in roster.present)
    counts = {"online": len(roster.present), "deaf": deaf, "faulty": faulty, "closed": closed}
    yield _by_label(
        "lippmann_workers",
        "Workers: all that are online, deaf, faulty, and those that are drained, out of hours or of another version.",
        "state",
        counts,
    )
    versions = Counter(worker.version for worker in roster.present)
    yield _by_label("lippmann_workers_by_version", "Workers that are online, by version.", "version", versions)


def _of_store(store: StoreReading, settings: Settings) -> Iterator[Metric]:
    if store.free_bytes is not None:
        yield _gauge("lippmann_store_free_bytes", "Free bytes of the disk of the store.", store.free_bytes)
    if store.free_files is not None:
        yield _gauge("lippmann_store_free_inodes", "Files that the disk of the store still takes.", store.free_files)
    yield _gauge(
        "lippmann_store_reserve_bytes",
        "The free bytes below which jobs are paused.",
        settings.disk_reserve_bytes,
    )


def _leads(database: DatabaseReading, now_s: float) -> bool:
    return database.leader is not None and database.leader_until_s >= now_s


def _gauge(name: str, text: str, value: float) -> Metric:
    return GaugeMetricFamily(name, text, value=float(value))


def _by_label(name: str, text: str, label: str, values: Mapping[str, float]) -> Metric:
    family = GaugeMetricFamily(name, text, labels=(label,))
    for value, count in sorted(values.items()):
        family.add_metric((value,), float(count))
    return family
