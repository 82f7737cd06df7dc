"""Readings of database, broker and store about the farm. One that is away delays none of the others."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import anyio

from lippmann.job.states import ENDED_JOBS, JobStatus
from lippmann.plan.artifact_store import ArtifactStore, LimitsFiles
from service.broker_stream import Stream
from service.db import coordinator as coordinator_rows
from service.db import farm as farm_rows
from service.db.engine import Database
from service.db.farm import TaskRow, WantRow
from service.db.jobs import OPEN
from service.roster import Roster, read_roster
from service.schemas.farm import Fault

ANSWER_S = 3.0
"""The longest time for which a reading waits for each of them; Prometheus gives up after 10 s."""
KEPT_S = 1.0
"""The time for which a reading is kept, so that many readers cost the farm no more than one."""
ENDED_KEPT_S = 60.0
"""The time for which the number of ended jobs is kept, since there may be very many to count."""

T = TypeVar("T")


@dataclass(frozen=True)
class DatabaseReading:
    """The figures that the database holds."""

    tasks: Sequence[TaskRow]
    wanted: Sequence[WantRow]
    jobs: Mapping[JobStatus, int]
    oldest_queued_s: float | None
    artifact_bytes: int
    webhooks: tuple[int, int]
    """The messages that were not tried yet, and those that are tried again."""
    faults: tuple[Fault, ...]
    dropped: Mapping[str, int]
    leader: str | None
    leader_until_s: float


@dataclass(frozen=True)
class StoreReading:
    """The free room of the store."""

    free_bytes: int | None
    free_files: int | None


@dataclass(frozen=True)
class FarmReading:
    """A farm at one moment. A part that did not answer has the value None."""

    at_s: float
    database: DatabaseReading | None
    roster: Roster | None
    store: StoreReading | None


class FarmReader:
    """Reads the farm, at most once in `KEPT_S`."""

    def __init__(
        self, database: Database, store: ArtifactStore, stream: Stream, *, steady: Callable[[], float] = time.monotonic
    ) -> None:
        self._questions: dict[str, Callable[[], Any]] = {
            "database": lambda: read_database(database, ended=self._ended_jobs(database)),
            "roster": lambda: read_roster(stream),
            "store": lambda: read_store(store),
        }
        self._steady = steady
        self._limiters: dict[str, anyio.CapacityLimiter] = {}
        self._lock = asyncio.Lock()
        self._latest: FarmReading | None = None
        self._until_s = float("-inf")
        self._ended: Mapping[JobStatus, int] = {}
        self._ended_until_s = float("-inf")

    async def read(self, *, now_s: float) -> FarmReading:
        """Return what is known now; readers that come at the same time get the same reading."""
        async with self._lock:
            if self._latest is None or self._steady() >= self._until_s:
                self._latest = await self._read(now_s)
                self._until_s = self._steady() + KEPT_S
            return self._latest

    async def _read(self, now_s: float) -> FarmReading:
        answers: dict[str, Any] = {}

        async def ask(name: str) -> None:
            answers[name] = await self._ask(name)

        async with anyio.create_task_group() as group:
            for name in self._questions:
                group.start_soon(ask, name)
        return FarmReading(at_s=now_s, **answers)

    async def _ask(self, name: str) -> Any:
        # Each has one thread: one that hangs takes no thread from the others, and no second one while it hangs.
        limiter = self._limiters.setdefault(name, anyio.CapacityLimiter(1))
        with anyio.move_on_after(ANSWER_S):
            try:
                return await anyio.to_thread.run_sync(self._questions[name], abandon_on_cancel=True, limiter=limiter)
            except Exception:  # whatever it is, this part does not answer; health names the reason
                return None
        return None

    def _ended_jobs(self, database: Database) -> Mapping[JobStatus, int]:
        if self._steady() >= self._ended_until_s:
            with database.reading() as session:
                self._ended = farm_rows.jobs(session, ENDED_JOBS)
            self._ended_until_s = self._steady() + ENDED_KEPT_S
        return self._ended


def read_database(database: Database, *, ended: Mapping[JobStatus, int]) -> DatabaseReading:
    """Return what the database says now, with a number of ended jobs that was counted before."""
    with database.reading() as session:
        row = coordinator_rows.current(session)
        now_s = time.time()
        ahead_s = now_s - coordinator_rows.clock_s(session, local_s=now_s)
        return DatabaseReading(
            tasks=farm_rows.tasks(session),
            wanted=farm_rows.wanted(session),
            jobs={**ended, **farm_rows.jobs(session, OPEN)},
            oldest_queued_s=farm_rows.oldest_queued_s(session),
            artifact_bytes=farm_rows.artifact_bytes(session),
            webhooks=farm_rows.webhooks(session),
            faults=coordinator_rows.faults(session),
            dropped=dict(row.dropped or {}),
            leader=row.leader,
            leader_until_s=row.leader_until_s + ahead_s,  # as this machine tells the time
        )


def read_store(store: ArtifactStore) -> StoreReading:
    """Return what the store says now."""
    store.exists("scenes/none.zip")
    return StoreReading(
        free_bytes=store.free_bytes(), free_files=store.free_files() if isinstance(store, LimitsFiles) else None
    )
