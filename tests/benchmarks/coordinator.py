"""The coordinator under load and at rest: simulated slots, jobs of different sizes, jobs that only wait."""

from __future__ import annotations

import base64
import json
import multiprocessing
import resource
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from shutil import copy

import redis
from sqlalchemy import insert, select

from lippmann.job.messages import wire
from lippmann.job.messages.orders import Order
from service.coordinator.coordinator import Coordinator
from service.db.engine import Database
from service.db.tables import Job, Task
from service.events.wakeup import Wakeup
from tests.broker import Broker
from tests.builders_messages import put_presence, seals_in
from tests.builders_service import Farm, claimed, done, presence
from tests.postgresql import new_database, running_postgresql
from tests.waiting import until

SLOTS = 1_000
FRAMES = 5_000
"""The frames of the job of the simulated slots: 3 tasks each."""
WITHIN_S = 600.0
SMALL, LARGE = 66, 100_000
"""The frames of a job of 200 tasks, and of one of 300,000."""
FOLLOWED = 64
"""The tasks that are dispatched and followed together."""
ROUNDS = 8
JOBS = 2_000
IDLE_S = 30.0


def sqlite_rate(folder: Path) -> str:
    """Return the tasks per second of one coordinator with simulated slots, on SQLite."""
    return f"{_rate(f'sqlite:///{folder}/farm.db', folder):.0f}/s"


def postgresql_rate(folder: Path) -> str:
    """Return the tasks per second of one coordinator with simulated slots, on PostgreSQL."""
    with running_postgresql() as server, new_database(server) as url:
        return f"{_rate(url, folder):.0f}/s"


def follow_ratio(folder: Path) -> str:
    """Return the CPU time to dispatch and follow a task of a large job, against one of a small job."""
    small_s, large_s = (_follow_s(folder, frames) for frames in (SMALL, LARGE))
    return f"{large_s / small_s:.2f} ({1e3 * large_s:.2f} / {1e3 * small_s:.2f} ms)"


def idle_share(folder: Path) -> str:
    """Return the share of a core that the coordinator takes while many jobs wait and nothing can be dispatched."""
    farm = Farm(f"sqlite:///{folder}/farm.db", data_dir=folder)
    job_id = farm.submit(frames="1-90")
    with farm.writing() as session:
        job = dict(session.execute(select(Job.__table__)).mappings().one())
        tasks = [dict(row) for row in session.execute(select(Task.__table__)).mappings()]
        names = [f"{job_id}{number:05}" for number in range(JOBS)]
        session.execute(insert(Job), [job | {"id": name} for name in names])
        session.execute(insert(Task), [task | {"job_id": name} for name in names for task in tasks])
    broker = Broker(folder)
    with coordinating(farm, broker) as coordinator:
        until(lambda: coordinator.election.is_leader)
        time.sleep(15.0)  # the first rounds of a new leader recount all jobs, and then the scheduler finds nothing
        used_s, begun_s = _cpu_s(), time.monotonic()
        time.sleep(IDLE_S)
        share = (_cpu_s() - used_s) / (time.monotonic() - begun_s)
    broker.kill()
    return f"{100 * share:.1f} %"


@contextmanager
def coordinating(farm: Farm, broker: Broker) -> Iterator[Coordinator]:
    """Run a coordinator in this process."""
    # A machine that is busy with other things must not take the leadership away.
    settings = farm.settings.model_copy(update={"redis_url": broker.url, "leader_ttl_s": 120.0})
    coordinator = Coordinator(farm.database, farm.store, settings, Wakeup())
    coordinator.start()
    try:
        yield coordinator
    finally:
        coordinator.stop()
        farm.database.dispose()


def _rate(url: str, folder: Path) -> float:
    farm = Farm(url, data_dir=folder)
    job_id = farm.planned(frames=f"1-{FRAMES}", outputs=[])
    broker = Broker(folder)
    worker = multiprocessing.get_context("spawn").Process(
        target=simulated_slots, args=(broker.url, folder), daemon=True
    )
    worker.start()
    with coordinating(farm, broker):
        # The first and the last tasks are not counted: the queue fills and empties.
        begun_s, begun = done_at(farm.database, job_id, FRAMES // 2)
        ended_s, ended = done_at(farm.database, job_id, 5 * FRAMES // 2)
    worker.kill()
    broker.kill()
    return (ended - begun) / (ended_s - begun_s)


def done_at(database: Database, job_id: str, tasks: int, *, every_s: float = 0.01) -> tuple[float, int]:
    """Wait until so many tasks of a job are done, asking in an interval; return the time and their number then."""

    def count() -> int:
        with database.reading() as session:
            return session.scalar(select(Job.done).where(Job.id == job_id)) or 0

    until(lambda: count() >= tasks, within_s=WITHIN_S, every_s=every_s)
    return time.monotonic(), count()


def simulated_slots(url: str, data_dir: Path) -> None:
    """Do what the slots of a farm do, in no time: take orders, and report each of them as claimed and done."""
    client, seals = redis.Redis.from_url(url, protocol=2), seals_in(data_dir)
    key, seen_s = wire.CARRIER_PREFIX + wire.QUEUE, 0.0
    while True:
        if time.monotonic() - seen_s > 2.0:
            put_presence(client, presence("w1", SLOTS), seals, ex=20)
            seen_s = time.monotonic()
        messages: Sequence[bytes] = client.rpop(key, SLOTS) or ()  # type: ignore[assignment]  # the client is not async
        if not messages:
            time.sleep(0.002)
        pipe = client.pipeline(transaction=False)
        for message in messages:
            order = Order.model_validate(json.loads(base64.b64decode(json.loads(message)["body"]))[1]["order"])
            for event in (claimed(order), done(order)):
                pipe.xadd(
                    wire.EVENTS_STREAM, {"event": seals.sealed_event(event)}, maxlen=wire.EVENTS_KEPT, approximate=True
                )
        pipe.execute()


def _follow_s(folder: Path, frames: int) -> float:
    """Return the CPU time per task to dispatch the first tasks of a new job and to follow their events: the least."""
    new, used = folder / f"{frames}.db", folder / "used.db"
    farm = Farm(f"sqlite:///{new}", data_dir=folder)
    farm.planned(frames=f"1-{frames}", outputs=[])
    farm.database.checkpoint()
    farm.database.dispose()

    def follow() -> float:
        copy(new, used)
        farm = Farm(f"sqlite:///{used}", data_dir=folder)
        farm.workers = [presence(slots=FOLLOWED // 2)]
        begun_s = time.process_time()
        for _ in range(2):  # render tasks, and then assembly tasks too
            orders = farm.dispatch()
            assert len(orders) == FOLLOWED
            farm.say(*map(claimed, orders))
            farm.say(*map(done, orders))
        spent_s = time.process_time() - begun_s
        farm.database.dispose()
        for left in folder.glob("used.db*"):
            left.unlink()
        return spent_s / (2 * FOLLOWED)

    return min(follow() for _ in range(ROUNDS))


def _cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime
