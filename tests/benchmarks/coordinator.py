"""The coordinator: jobs of different sizes, and jobs that only wait."""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import copy

from sqlalchemy import insert, select

from service.coordinator.coordinator import Coordinator
from service.db.tables import Job, Task
from service.events.wakeup import Wakeup
from tests.broker import Broker
from tests.builders_service import DictStore, Farm, claimed, done, presence
from tests.waiting import until

SMALL, LARGE = 66, 100_000
"""The frames of a job of 200 tasks, and of one of 300,000."""
FOLLOWED = 64
"""The tasks that are dispatched and followed together."""
ROUNDS = 8
JOBS = 2_000
IDLE_S = 30.0


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
        time.sleep(5.0)  # the first rounds of a new leader recount all jobs
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
    coordinator = Coordinator(farm.database, DictStore(), settings, Wakeup())
    coordinator.start()
    try:
        yield coordinator
    finally:
        coordinator.stop()
        farm.database.dispose()


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
