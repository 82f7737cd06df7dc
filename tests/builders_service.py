"""Builders of what service tests need: a store, scenes, a farm to call, and what workers say."""

from __future__ import annotations

import builtins
import errno
import hashlib
import json
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from sqlalchemy.orm import Session, undefer

from lippmann.digest import Digest, digest_of
from lippmann.errors import ArtifactMissing, BundleError, StoreFull, StoreUnavailable
from lippmann.job.messages.events import Event, EventKind, Failure, Presence, ProbeResult
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.scenes.scene import SceneManifest
from lippmann.job.scenes.stage import Stage
from lippmann.plan.artifact_store import ArtifactInfo, Moved, unwatched
from service.api.waits import Outlook
from service.auth import Caller
from service.coordinator import scheduler as dispatching
from service.coordinator.artifact_repairer import ArtifactRepairer
from service.coordinator.background_jobs import ON_ARTIFACTS, ON_ROWS, BackgroundJobs
from service.coordinator.event_consumer import consume_events
from service.db.engine import Database
from service.db.migrations import migrate
from service.db.tables import CoordinatorRow, Job, Task
from service.ids import parse_task_id
from service.jobs.submission import submit_job
from service.order_queue import OrderQueue
from service.ports import Parts
from service.roster import Roster
from service.scenes import sync_builtin
from service.schemas.access import KeyLimits, Role
from service.settings import Settings

with warnings.catch_warnings():
    # Starlette's client asks for httpx2, which nothing else here needs; with httpx it works as it always did.
    warnings.simplefilter("ignore")
    from fastapi.testclient import TestClient


Client = TestClient
T0 = 1_900_000_000.0
PROBE = ProbeResult(start_s=0.5, s_per_px=1e-5, tileable=True)
CALLER = Caller(id="k", key_id="k", name="tester", role=Role.SUBMITTER, owner_id="k")


def owner(owner_id: str, **limits: int) -> Caller:
    """Return a submitter whose key has some limits."""
    limited = KeyLimits.model_validate(limits)
    return Caller(id=owner_id, key_id=owner_id, name=owner_id, role=Role.SUBMITTER, owner_id=owner_id, limits=limited)


CARD = SceneManifest(
    title="A ball",
    stage=Stage(location=(0, 0, -500), look_at=(0, 0, 0), reference_mm=500, near_mm=400, far_mm=600),
)
SPEC: dict[str, Any] = {
    "scene": "ball",
    "frames": "1-3",
    "rig": {"lens_array": {"count": [10, 10]}},
    "render": {"tiles": [2, 1]},
    "outputs": ["views.mp4"],
}
"""Probe, then 3 frames of 2 tiles each and their assembly, then 1 video."""


@dataclass
class DictStore:
    """A store in memory; `full` and `away` make it refuse."""

    files: dict[str, bytes] = field(default_factory=dict)
    full: bool = False
    away: bool = False
    free: int = 10**12
    asked: list[str] = field(default_factory=list)
    written_s: dict[str, float] = field(default_factory=dict)
    """When files were written that were not at T0."""
    own_identity: str | None = None

    def identity(self) -> str | None:
        return self.own_identity

    def make_identity(self) -> str:
        self.own_identity = self.own_identity or "memory"
        return self.own_identity

    def expect(self, identity: str | None) -> None:
        """A store in memory is never another one."""

    def put_bytes(self, name: str, data: bytes) -> Digest:
        if self.full:
            raise StoreFull("no room") from OSError(errno.ENOSPC, "No space left on device")
        if self.away:
            raise StoreUnavailable("away") from OSError(errno.EROFS, "Read-only file system")
        self.files[name] = data
        return digest_of([data])

    def put_file(self, name: str, path: Path, *, moved: Moved = unwatched) -> Digest:
        return self.put_bytes(name, path.read_bytes())

    def link(self, source: str, name: str) -> None:
        self.put_bytes(name, self.get_bytes(source))

    def get_bytes(self, name: str) -> bytes:
        if name not in self.files:
            raise ArtifactMissing(f"there is no artifact {name!r}")
        return self.files[name]

    def exists(self, name: str) -> bool:
        self.asked.append(name)
        return name in self.files

    def size(self, name: str) -> int:
        return len(self.get_bytes(name))

    def etag(self, name: str) -> str:
        return hashlib.sha256(self.get_bytes(name)).hexdigest()[:16]

    def info(self, name: str) -> ArtifactInfo:
        return ArtifactInfo(name, self.size(name), self.modified_s(name), self.etag(name))

    def read_range(self, name: str, start: int, stop: int) -> Iterator[bytes]:
        yield self.get_bytes(name)[start:stop]

    def list(self, prefix: str, *, after: str = "", limit: int | None = None) -> builtins.list[ArtifactInfo]:
        names = sorted(name for name in self.files if name.startswith(prefix) and name > after)
        return [self.info(name) for name in names[:limit]]

    def modified_s(self, name: str) -> float:
        return self.written_s.get(name, T0)

    def folders(self) -> builtins.list[str]:
        return sorted({name.partition("/")[0] for name in self.files if "/" in name})

    def free_bytes(self) -> int | None:
        return self.free

    def delete(self, prefix: str) -> None:
        for name in [name for name in self.files if name.startswith(prefix)]:
            del self.files[name]

    @contextmanager
    def local_path(self, name: str, *, moved: Moved = unwatched) -> Iterator[Path]:
        path = Path("/nonexistent") / name
        self.get_bytes(name)
        yield path


class FakePictures:
    """Says what it was asked for instead of converting it."""

    def png(self, path: Path, *, bits: int = 8) -> bytes:
        return f"png of {path.name}, {bits} bits".encode()

    def light(self, path: Path) -> NDArray[np.float16]:
        raise NotImplementedError("no light in memory")

    def scene_depth(self, path: Path) -> NDArray[np.float32]:
        raise NotImplementedError("no depth in memory")

    def pfm(self, values: NDArray[np.float32]) -> bytes:
        return f"{values.shape} as PFM".encode()

    def encode(self, light: NDArray[np.floating[Any]], **how: Any) -> bytes:
        return f"{light.shape} as {how}".encode()


@dataclass(frozen=True)
class Bundle:
    card: SceneManifest
    digest: str
    poster: bytes | None = b"poster"
    notes: tuple[str, ...] = ("a note",)


class FakeScenes:
    """One scene; a bundle is whole when it begins with PK."""

    def builtin(self) -> dict[str, bytes]:
        return {"ball": b"PK ball"}

    def check(self, data: bytes) -> Bundle:
        if not data.startswith(b"PK"):
            raise BundleError("scene.toml: expected a zip, got something else")
        return Bundle(CARD, hashlib.sha256(data).hexdigest())


def parts() -> Parts:
    return Parts(store=DictStore(), pictures=FakePictures(), scenes=FakeScenes())


def presence(name: str = "w1", slots: int = 2) -> Presence:
    return Presence(
        name=name, host="h", pid=1, slots=slots, sandbox="bwrap", povray="3.7", version="0", started_s=T0, seen_s=T0
    )


@dataclass
class RecordingQueue:
    """Keeps the orders that were published; `error` is raised instead once it is set."""

    orders: list[Order] = field(default_factory=list)
    error: Exception | None = None

    def publish(self, orders: Any) -> None:
        if self.error is not None:
            raise self.error
        self.orders += orders


class Farm:
    """The use cases on a database of their own, with a clock that the test moves and workers that it plays."""

    def __init__(self, url: str, *, given: Parts | None = None, **settings: Any) -> None:
        self.settings = Settings(database_url=url, **settings)
        self.database = Database(url)
        self.parts = given or parts()
        self.store: DictStore = self.parts.store  # type: ignore[assignment]
        self.queue = RecordingQueue()
        self.workers = [presence()]
        self.now_s = T0
        self._entries = 0
        migrate(self.database)
        sync_builtin(self.database, self.parts, now_s=T0)
        self.repairer = ArtifactRepairer(self.database, self.store, self.settings)
        self.background_jobs = BackgroundJobs(self.database, self.store, self.settings, kinds=ON_ROWS | ON_ARTIFACTS)

    def submit(self, *, caller: Caller = CALLER, **changes: Any) -> str:
        job, _ = submit_job(
            self.database, self.parts, caller, SPEC | changes, idempotency_key=None, now_s=self.now_s,
            settings=self.settings,
        )  # fmt: skip
        return job.id

    def dispatch(self) -> list[Order]:
        before = len(self.queue.orders)
        queue = cast(OrderQueue, self.queue)
        dispatching.dispatch(self.database, queue, self.workers, now_s=self.now_s, settings=self.settings)
        return self.queue.orders[before:]

    def say(self, *events: Event) -> bool:
        """Let workers say something."""
        with self.database.reading() as session:
            was = session.get_one(CoordinatorRow, 1).stream_position
        entries = []
        for event in events:
            self._entries += 1
            entries.append((f"{self._entries}-0", event))
        return consume_events(self.database, entries, was=was, now_s=self.now_s, settings=self.settings)

    def plan(self) -> None:
        while self.background_jobs.run_round(slots=2, now_s=self.now_s):
            pass

    def repair(self) -> None:
        """Verify and take back what the artifact repairer has to."""
        while self.repairer.run_round(now_s=self.now_s):
            pass

    def planned(self, **changes: Any) -> str:
        """Submit a job and get it past its probe."""
        return self.planned_jobs(1, **changes)[0]

    def planned_jobs(self, count: int, **changes: Any) -> list[str]:
        """Submit jobs and get all of them past their probes."""
        job_ids = [self.submit(**changes) for _ in range(count)]
        for order in self.dispatch():
            assert order.kind is TaskKind.PROBE
            self.say(claimed(order), done(order))
        self.plan()
        return job_ids

    def work(self, rounds: int = 1000) -> int:
        """Do what is sent out until nothing is; returns how many orders were done."""
        total = 0
        for _ in range(rounds):
            orders = self.dispatch()
            if not orders:
                return total
            for order in orders:
                self.say(claimed(order), done(order))
            total += len(orders)
            self.plan()
        return total

    def outlook(self, *, broker: bool = True, not_claiming: Sequence[str] = ()) -> Outlook:
        """Return what a request knows besides the database; without the broker, nothing of the workers."""
        roster = Roster(tuple(self.workers), dict.fromkeys(not_claiming, self.now_s)) if broker else None
        return Outlook(self.now_s, self.settings, roster)

    def job(self, job_id: str) -> Job:
        with self.database.reading() as session:
            return session.get_one(Job, job_id)

    def task(self, order: Order | str) -> Task:
        with self.database.reading() as session:
            key = parse_task_id(order if isinstance(order, str) else order.task_id)
            return session.get_one(Task, key, options=[undefer(Task.digests)])

    def tasks(self, job_id: str) -> list[Task]:
        with self.database.reading() as session:
            return (
                session.query(Task)
                .options(undefer(Task.digests))
                .filter(Task.job_id == job_id)
                .order_by(Task.sequence)
                .all()
            )

    @contextmanager
    def writing(self) -> Iterator[Session]:
        with self.database.writing() as session:
            yield session


def event(order: Order, kind: EventKind, worker: str = "w1", **more: Any) -> Event:
    return Event(
        kind=kind, job_id=order.job_id, task_id=order.task_id, attempt=order.attempt, worker=worker, at_s=T0, **more
    )


def claimed(order: Order, worker: str = "w1") -> Event:
    return event(order, EventKind.CLAIMED, worker)


def heartbeat(order: Order, progress: float = 0.5, worker: str = "w1") -> Event:
    return event(order, EventKind.HEARTBEAT, worker, progress=progress)


def done(
    order: Order,
    worker: str = "w1",
    cpu_s: float = 2.0,
    wall_s: float = 4.0,
    digests: dict[str, Digest] | None = None,
) -> Event:
    probe = PROBE if order.kind is TaskKind.PROBE else None
    return event(order, EventKind.DONE, worker, cpu_s=cpu_s, wall_s=wall_s, probe=probe, digests=digests or {})


def failed(
    order: Order,
    worker: str = "w1",
    *,
    code: str = "render-failed",
    permanent: bool = False,
    frame: int | None = None,
    artifact: str | None = None,
) -> Event:
    failure = Failure(code=code, message=f"{code} happened", permanent=permanent, frame=frame, artifact=artifact)
    return event(order, EventKind.FAILED, worker, failure=failure)


def declined(order: Order, worker: str = "w1") -> Event:
    return event(order, EventKind.DECLINED, worker)


def canonical(row: Job | Task) -> str:
    """Return everything that a row says."""
    return json.dumps({c.name: getattr(row, c.name) for c in row.__table__.columns}, default=str, sort_keys=True)
