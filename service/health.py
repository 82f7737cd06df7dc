"""Health checks with a time limit: a component that does not answer in time is not healthy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Protocol, TypeVar

import anyio

from lippmann.job.messages.events import Presence
from lippmann.job.messages.protocol import PROTOCOL
from lippmann.plan.artifact_store import ArtifactStore
from service.broker_stream import BrokerKeeping, Stream
from service.db import coordinator as coordinator_rows
from service.db import drains as drain_rows
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.engine import Database
from service.db.faults import avoiding
from service.roster import Roster, read_roster
from service.schemas.access import Role
from service.schemas.farm import (
    ComponentHealth,
    CoordinatorHealth,
    DroppedMessages,
    ExcludedWorker,
    Fault,
    Health,
    StoreHealth,
    Worker,
    WorkerList,
)

ANSWER_S = 0.8
"""The longest time of one check."""
_THREADS = 8
"""The largest number of threads for checks; a check that hangs keeps its thread."""

WORKER_VERSION = "worker-version"
"""The code of the fault of a worker whose messages the service does not understand."""
NOT_CLAIMING = "not-claiming"
"""The code of the fault of a worker that takes no orders although it has a free slot."""

NOT_KEPT = "answers; it has no append-only file, so orders that a restart of it loses are sent again"

T = TypeVar("T")


class Monitor(Protocol):
    """Knows what prevents work; the fault monitor of this process, if it has a coordinator."""

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The causes that prevent all work of the farm, first cause first."""


@dataclass(frozen=True)
class Marks:
    """The workers as the database knows them."""

    running: Mapping[str, int] = field(default_factory=dict)
    """The number of tasks of open jobs that each of them runs."""
    drained: frozenset[str] = frozenset()
    """The worker processes that an admin has drained, by instance."""
    excluded: tuple[ExcludedWorker, ...] = ()
    avoided_by: Mapping[str, int] = field(default_factory=dict)
    """The number of open jobs that avoid each of them."""


class Checks:
    """Checks the components that the service needs."""

    monitor: Monitor | None = None
    """A database that cannot be written cannot tell what the monitor of this process has found."""

    def __init__(self, database: Database, store: ArtifactStore, stream: Stream) -> None:
        self._database = database
        self._store = store
        self._stream = stream
        self._limiter: anyio.CapacityLimiter | None = None

    async def health(self, *, now_s: float, role: Callable[[], Role | None]) -> Health:
        """Run all checks at once; a caller without a role learns which components are healthy and no more."""
        answers: dict[str, object] = {}

        async def ask(name: str, question: Callable[[], object]) -> None:
            answers[name] = await self._ask(question)

        async with anyio.create_task_group() as group:
            group.start_soon(ask, "coordinator", lambda: self._coordinator(now_s))
            group.start_soon(ask, "workers", self._roster)
            group.start_soon(ask, "free", self._free_bytes)
            group.start_soon(ask, "faults", self._faults)
            group.start_soon(ask, "dropped", self._dropped)
            group.start_soon(ask, "keeping", self._stream.keeping)
            group.start_soon(ask, "role", role)
        health = _health(answers["coordinator"], answers["workers"], answers["free"], answers["faults"])
        keeping = answers["keeping"]
        if health.broker.ok and isinstance(keeping, BrokerKeeping) and not keeping.has_append_only_file:
            health = health.model_copy(update={"broker": ComponentHealth(ok=True, detail=NOT_KEPT)})
        if not isinstance(answers["role"], Role):
            return _without_details(health)
        if answers["role"] is not Role.ADMIN:
            return health
        return health.model_copy(update={"dropped": _dropped(answers["dropped"], answers["workers"])})

    async def workers(self, *, now_s: float) -> WorkerList:
        """Return the workers that are online, with their running tasks, and those that are excluded."""
        roster = await self._ask(self._roster)
        stored = await self._ask(lambda: self._stored_marks(now_s))
        marks = Marks() if isinstance(stored, Exception) else stored
        if isinstance(roster, Exception):
            return WorkerList(items=(), known=False, excluded=marks.excluded)
        items = tuple(_worker(one, marks, roster.not_claiming) for one in roster.present)
        return WorkerList(items=items, known=True, excluded=marks.excluded)

    async def _ask(self, question: Callable[[], T]) -> T | Exception:
        self._limiter = self._limiter or anyio.CapacityLimiter(_THREADS)
        try:
            with anyio.fail_after(ANSWER_S):
                return await anyio.to_thread.run_sync(question, abandon_on_cancel=True, limiter=self._limiter)
        except TimeoutError:
            return TimeoutError(f"no answer within {ANSWER_S} s")
        except Exception as error:  # the error is the result of the check
            return error

    def _coordinator(self, now_s: float) -> CoordinatorHealth:
        with self._database.reading() as session:
            leader = coordinator_rows.leader(session, now_s=now_s)
            return CoordinatorHealth(ok=leader is not None, leader=leader)

    def _faults(self) -> tuple[Fault, ...]:
        if self.monitor is not None and self.monitor.faults:
            return self.monitor.faults
        with self._database.reading() as session:
            return coordinator_rows.faults(session)

    def _dropped(self) -> Mapping[str, int]:
        with self._database.reading() as session:
            return coordinator_rows.dropped(session)

    def _roster(self) -> Roster:
        return read_roster(self._stream)

    def _free_bytes(self) -> int | None:
        self._store.exists("scenes/none.zip")
        return self._store.free_bytes()

    def _stored_marks(self, now_s: float) -> Marks:
        with self._database.reading() as session:
            return Marks(
                running=task_rows.running_on(session, job_rows.open_ids(session)),
                drained=frozenset(drain_rows.drains(session)),
                excluded=tuple(
                    ExcludedWorker(worker=row.worker, name=row.name, since_s=row.since_s)
                    for row in drain_rows.exclusions(session)
                ),
                avoided_by=avoiding(session, now_s=now_s),
            )


def package_version() -> str:
    """Return the version of this package."""
    try:
        return version("lippmann")
    except PackageNotFoundError:
        return "0+unknown"


def _health(coordinator: object, workers: object, free: object, found: object) -> Health:
    faults = _all_faults(found, workers)
    database = ComponentHealth(**_answer("database", coordinator, faults))
    broker = ComponentHealth(**_answer("broker", workers, faults))
    store = StoreHealth(**_answer("store", free, faults), free_bytes=free if isinstance(free, int) else None)
    leading = coordinator if isinstance(coordinator, CoordinatorHealth) else CoordinatorHealth(ok=False, leader=None)
    roster = workers if isinstance(workers, Roster) else None
    return Health(
        status="ok" if all((database.ok, broker.ok, store.ok, leading.ok)) and not faults else "degraded",
        version=package_version(),
        database=database,
        broker=broker,
        store=store,
        coordinator=leading,
        workers=None if roster is None else len(roster.present),
        slots=None if roster is None else roster.slots,
        sandboxes=None if roster is None else tuple(sorted({worker.sandbox for worker in roster.present})),
        faults=faults,
        notes=() if roster is None else tuple(filter(None, map(version_note, roster.present))),
    )


def _without_details(health: Health) -> Health:
    """Return which components are healthy, without versions, hosts, paths and numbers."""
    return Health(
        status=health.status,
        version="",
        database=ComponentHealth(ok=health.database.ok, detail=""),
        broker=ComponentHealth(ok=health.broker.ok, detail=""),
        store=StoreHealth(ok=health.store.ok, detail="", free_bytes=None),
        coordinator=CoordinatorHealth(ok=health.coordinator.ok, leader=None),
        workers=None,
        slots=None,
    )


def _dropped(found: object, workers: object) -> DroppedMessages | None:
    if not isinstance(found, Mapping):
        return None
    orders = sum(worker.refused_orders for worker in workers.present) if isinstance(workers, Roster) else None
    counts = {name: found.get(name.removesuffix("s"), 0) for name in ("events", "presences", "leases")}
    return DroppedMessages(**counts, orders=orders)


def _all_faults(found: object, workers: object) -> tuple[Fault, ...]:
    """Return the faults of the farm and those of single workers."""
    of_farm = found if isinstance(found, tuple) else ()
    if any(fault.component == "workers" for fault in of_farm) or not isinstance(workers, Roster):
        return of_farm
    return (*of_farm, *(fault for worker in workers.present for fault in _faults_of(worker, workers.not_claiming)))


def _answer(component: str, answer: object, faults: Sequence[Fault]) -> dict[str, Any]:
    """Return whether a component is healthy, and what is wrong."""
    fault = next((fault for fault in faults if fault.component == component), None)
    is_ok = fault is None and not isinstance(answer, Exception)
    return {"ok": is_ok, "detail": _detail(answer) if fault is None else fault.message}


def _detail(answer: object) -> str:
    if not isinstance(answer, Exception):
        return "answers"
    # This answer needs no key, so it names the kind of the error but no addresses.
    return str(answer) if isinstance(answer, TimeoutError) else type(answer).__name__


def version_note(worker: Presence) -> str | None:
    """Return a sentence on the release of a worker if it is another one than that of the service."""
    if not worker.understands():
        return (
            f"{worker.name} runs Lippmann {worker.version} (messages {worker.protocol}), this service "
            f"{package_version()} (messages {PROTOCOL}): they do not understand each other, so it gets no orders."
        )
    if worker.version == package_version():
        return None
    return f"{worker.name} runs Lippmann {worker.version}, this service {package_version()}: upgrade the older one."


def _faults_of(worker: Presence, not_claiming: Mapping[str, float]) -> Iterator[Fault]:
    """Yield what a worker says of itself, and that it takes no orders."""
    if not worker.understands():
        message = version_note(worker) or ""
        yield Fault(component="workers", code=WORKER_VERSION, message=message, since_s=worker.started_s)
    if worker.fault is not None:
        message = f"{worker.name}: {worker.fault.message}."
        yield Fault(component="workers", code=worker.fault.code, message=message, since_s=worker.seen_s)
    if worker.name in not_claiming:
        message = f"{worker.name}: takes no orders although it has a free slot."
        yield Fault(component="workers", code=NOT_CLAIMING, message=message, since_s=not_claiming[worker.name])


def _worker(presence: Presence, marks: Marks, not_claiming: Mapping[str, float]) -> Worker:
    known = presence.model_dump(include=set(Worker.model_fields), exclude={"fault"})
    fault = None if presence.fault is None else presence.fault.message
    since_s = not_claiming.get(presence.name)
    return Worker(
        **known,
        running=marks.running.get(presence.name, 0),
        drained=presence.instance in marks.drained,
        excluded=any(one.worker == presence.name for one in marks.excluded),
        avoided_by=marks.avoided_by.get(presence.name, 0),
        fault=fault,
        not_claiming_since_s=since_s,
        version_note=version_note(presence),
    )
