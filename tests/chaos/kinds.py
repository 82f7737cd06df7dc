"""The kinds of faults, each a function that injects it once into a farm with a job that renders.

A kind returns when the fault is over or in the past. The harness brings back what is still away. All choices come from
the random generator of the run, so that a seed repeats them; when exactly they hit the job is not repeated.
"""

from __future__ import annotations

import os
import signal
import sqlite3
import time
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass
from random import Random
from typing import Any, Literal

from lippmann.job.outputs.videos import CentreVideo
from lippmann.job.spec import JobSpec
from lippmann.job.states import ENDED_JOBS
from tests.builders import small_job
from tests.chaos.parts import Part, Parts
from tests.damaging import DAMAGES, Damage
from tests.disks import away, read_only
from tests.network_host import NetworkHost
from tests.tcp_proxy import TcpProxy
from tests.waiting import until

Injection = Callable[[Parts, str, Random], float | None]
"""Injects a fault into a farm whose job has this id; may return the seconds until nothing was with a lost worker."""


@dataclass(frozen=True)
class Work:
    """A job of a trial: so many frames, each of so many lenses in a row and in a column, and of so many tiles."""

    frames: int
    lenses: int
    tiles: int
    compared: int = 1
    """The step of the frames whose pixels are compared with those of an undisturbed farm."""

    def spec(self, frames: str) -> JobSpec:
        """Return the job with some of its frames, and with a video."""
        spec = small_job("fish", count=(self.lenses, self.lenses), frames=frames, tiles=[self.tiles, 1])
        return spec.model_copy(update={"outputs": (CentreVideo(),)})


SHORT = Work(frames=12, lenses=40, tiles=2)
LONG = Work(frames=1000, lenses=10, tiles=1, compared=37)


@dataclass(frozen=True)
class Kind:
    """One kind of fault."""

    name: str
    inject: Injection
    keeps_data: bool = False
    """Whether the broker has its data again after a restart."""
    damages: bool = False
    """Whether it damages an artifact that no task reads again, so that a user has the job repaired."""
    work: Work = SHORT
    hosts: bool = False
    """Whether each worker is in a network namespace of its own, as on a host of its own."""
    recovers_within_s: float | None = None
    """The longest time until nothing is with a lost worker."""


KINDS: dict[str, Kind] = {}


def _add(name: str, inject: Injection, **more: Any) -> None:
    assert name not in KINDS, name
    KINDS[name] = Kind(name, inject, **more)


def _kind(name: str, **more: Any) -> Callable[[Injection], Injection]:
    def add(inject: Injection) -> Injection:
        _add(name, inject, **more)
        return inject

    return add


def _pause(rng: Random, low_s: float, high_s: float) -> None:
    """Sleep for a random time: the length of a fault is what is tried."""
    time.sleep(rng.uniform(low_s, high_s))


def _restart(parts: Parts, part: Part, rng: Random, *, after_s: tuple[float, float] = (0.0, 1.0)) -> None:
    part.kill()
    _pause(rng, *after_s)
    part.start()


# Processes


@_kind("worker: killed, starts again at once")
def _worker_killed(parts: Parts, job_id: str, rng: Random) -> None:
    _restart(parts, rng.choice(parts.workers), rng)


@_kind("worker: killed, starts again after 20 s")
def _worker_killed_long(parts: Parts, job_id: str, rng: Random) -> None:
    _restart(parts, rng.choice(parts.workers), rng, after_s=(19.0, 21.0))


@_kind("worker: killed, never comes back")
def _worker_gone(parts: Parts, job_id: str, rng: Random) -> float:
    worker = rng.choice(parts.workers)
    recovered_s = cut_off(parts, job_id, worker, worker.kill)
    until(lambda: parts.client.job(job_id).status != "running", within_s=600.0)
    return recovered_s


@_kind("worker: both killed")
def _workers_killed(parts: Parts, job_id: str, rng: Random) -> None:
    for worker in parts.workers:
        worker.kill()
    _pause(rng, 0.0, 5.0)


@_kind("worker: terminated, starts again")
def _worker_terminated(parts: Parts, job_id: str, rng: Random) -> None:
    worker = rng.choice(parts.workers)
    worker.terminate()
    worker.start()


def _stopped(part: Part, low_s: float, high_s: float, rng: Random) -> None:
    part.send(signal.SIGSTOP)
    _pause(rng, low_s, high_s)
    part.send(signal.SIGCONT)


@_kind("worker: stands still for 8 s")
def _worker_stopped(parts: Parts, job_id: str, rng: Random) -> None:
    _stopped(rng.choice(parts.workers), 7.0, 9.0, rng)


@_kind("worker: it and all below it stand still for 60 s")
def _worker_stopped_long(parts: Parts, job_id: str, rng: Random) -> None:
    worker = rng.choice(parts.workers)
    stopped = [worker.pid, *worker.below("lippmann"), *worker.pool(), *worker.below("povray")]
    for pid in stopped:
        _signal(pid, signal.SIGSTOP)
    _pause(rng, 58.0, 62.0)
    for pid in stopped:
        _signal(pid, signal.SIGCONT)


@_kind("worker: its pool process killed")
def _pool_killed(parts: Parts, job_id: str, rng: Random) -> None:
    worker = rng.choice(parts.workers)
    _signal(until(worker.pool)[0], signal.SIGKILL)


@_kind("worker: its pool process stands still for 60 s")
def _pool_stopped(parts: Parts, job_id: str, rng: Random) -> None:
    pid = until(rng.choice(parts.workers).pool)[0]
    _signal(pid, signal.SIGSTOP)
    _pause(rng, 58.0, 62.0)
    _signal(pid, signal.SIGCONT)


def _to_povray(number: signal.Signals) -> Injection:
    def inject(parts: Parts, job_id: str, rng: Random) -> None:
        worker = rng.choice(parts.workers)
        _signal(until(lambda: worker.below("povray"))[0], number)

    return inject


for _number in (signal.SIGKILL, signal.SIGSEGV, signal.SIGTERM, signal.SIGABRT):
    _add(f"povray: {_number.name}", _to_povray(_number))


@_kind("povray: stands still for 10 s")
def _povray_stopped(parts: Parts, job_id: str, rng: Random) -> None:
    worker = rng.choice(parts.workers)
    pid = until(lambda: worker.below("povray"))[0]
    _signal(pid, signal.SIGSTOP)
    _pause(rng, 9.0, 11.0)
    _signal(pid, signal.SIGCONT)


@_kind("service: killed, starts again")
def _service_killed(parts: Parts, job_id: str, rng: Random) -> None:
    _restart(parts, parts.service, rng, after_s=(0.0, 5.0))


@_kind("service: killed five times, 3 s apart")
def _service_killed_often(parts: Parts, job_id: str, rng: Random) -> None:
    for _ in range(5):
        _restart(parts, parts.service, rng)
        _pause(rng, 2.0, 4.0)


@_kind("service: terminated, starts again")
def _service_terminated(parts: Parts, job_id: str, rng: Random) -> None:
    parts.service.terminate()
    parts.service.start()


@_kind("service: stands still for 10 s")
def _service_stopped(parts: Parts, job_id: str, rng: Random) -> None:
    _stopped(parts.service, 9.0, 11.0, rng)


@_kind("service: stands still for 60 s")
def _service_stopped_long(parts: Parts, job_id: str, rng: Random) -> None:
    _stopped(parts.service, 58.0, 62.0, rng)


@_kind("all: every process killed, starts again")
def _all_killed(parts: Parts, job_id: str, rng: Random) -> None:
    for part in rng.sample(parts.processes, len(parts.processes)):
        part.kill()
    _pause(rng, 0.0, 5.0)


@_kind("all: every process and the broker killed, starts again")
def _all_and_broker_killed(parts: Parts, job_id: str, rng: Random) -> None:
    for part in rng.sample(parts.processes, len(parts.processes)):
        part.kill()
    parts.broker.kill()
    _pause(rng, 0.0, 5.0)


@_kind("all: 59 SIGKILLs to random processes")
def _kills(parts: Parts, job_id: str, rng: Random) -> None:
    for _ in range(59):
        rng.choice(parts.processes).kill_one(rng)
        _pause(rng, 0.2, 1.5)
        for part in parts.processes:
            part.start()


@_kind("all: a SIGKILL every 10 s, while 1,000 frames render", work=LONG)
def _kills_all_along(parts: Parts, job_id: str, rng: Random) -> None:
    # The video takes longer than the pause between two kills, and a task that is lost ten times is not tried again.
    while (job := parts.client.job(job_id)).status not in ENDED_JOBS and job.frames_done < job.frames_total:
        rng.choice(parts.processes).kill_one(rng)
        _pause(rng, 0.0, 1.0)
        for part in parts.processes:
            part.start()
        _pause(rng, 9.0, 10.0)


# The broker


@_kind("broker: killed, starts again with its data", keeps_data=True)
@_kind("broker: killed, starts again empty")
def _broker_killed(parts: Parts, job_id: str, rng: Random) -> None:
    parts.broker.kill()
    _pause(rng, 0.0, 5.0)
    parts.broker.start()


@_kind("broker: away for 60 s, starts again empty")
def _broker_away(parts: Parts, job_id: str, rng: Random) -> None:
    parts.broker.kill()
    _pause(rng, 58.0, 62.0)
    parts.broker.start()


@_kind("broker: restarted six times, 5 s apart")
def _broker_restarts(parts: Parts, job_id: str, rng: Random) -> None:
    for _ in range(6):
        parts.broker.kill()
        parts.broker.start()
        _pause(rng, 4.0, 6.0)


@_kind("broker: stands still for 10 s")
def _broker_stopped(parts: Parts, job_id: str, rng: Random) -> None:
    parts.broker.freeze()
    _pause(rng, 9.0, 11.0)
    parts.broker.thaw()


@_kind("broker: stands still for 60 s")
def _broker_stopped_long(parts: Parts, job_id: str, rng: Random) -> None:
    parts.broker.freeze()
    _pause(rng, 58.0, 62.0)
    parts.broker.thaw()


@_kind("broker: wiped")
def _wiped(parts: Parts, job_id: str, rng: Random) -> None:
    parts.redis.flushall()


def _deleted(pattern: str) -> Injection:
    def inject(parts: Parts, job_id: str, rng: Random) -> None:
        keys = until(lambda: list(parts.redis.scan_iter(match=pattern)))
        parts.redis.delete(*keys)

    return inject


for _what, _pattern in {
    "all orders": "lippmann:celery:*",
    "the stream of events": "lippmann:events",
    "the leases": "lippmann:lease:*",
    "the presences": "lippmann:worker:*",
    "the marker": "lippmann:broker",
}.items():
    _add(f"broker: {_what} deleted", _deleted(_pattern))


@_kind("broker: the stream of events trimmed to nothing, ten times")
def _trimmed(parts: Parts, job_id: str, rng: Random) -> None:
    for _ in range(10):
        parts.redis.xtrim("lippmann:events", maxlen=0, approximate=False)
        _pause(rng, 0.1, 1.0)


@_kind("broker: every event twice")
def _events_twice(parts: Parts, job_id: str, rng: Random) -> None:
    for _, fields in parts.redis.xrange("lippmann:events"):
        parts.redis.xadd("lippmann:events", fields)


@_kind("broker: every order twice")
def _orders_twice(parts: Parts, job_id: str, rng: Random) -> None:
    queue = "lippmann:celery:lippmann"
    orders = until(lambda: parts.redis.lrange(queue, 0, -1))
    parts.redis.lpush(queue, *orders)


@_kind("broker: out of memory for 15 s")
def _broker_full(parts: Parts, job_id: str, rng: Random) -> None:
    parts.redis.config_set("maxmemory", 1)
    _pause(rng, 14.0, 16.0)
    parts.redis.config_set("maxmemory", 0)


@_kind("broker: read-only for 15 s")
def _broker_read_only(parts: Parts, job_id: str, rng: Random) -> None:
    parts.redis.config_set("min-replicas-to-write", 1)
    _pause(rng, 14.0, 16.0)
    parts.redis.config_set("min-replicas-to-write", 0)


@_kind("broker: every connection ended, ten times")
def _connections_ended(parts: Parts, job_id: str, rng: Random) -> None:
    for _ in range(10):
        parts.redis.client_kill_filter(_type="normal", skipme=True)
        _pause(rng, 0.2, 2.0)


# The network between a part and the broker


def _network(whose: Literal["worker", "service"], change: Callable[[TcpProxy], None], seconds: float) -> Injection:
    def inject(parts: Parts, job_id: str, rng: Random) -> None:
        link = (parts.service if whose == "service" else rng.choice(parts.workers)).link
        assert isinstance(link, TcpProxy)
        change(link)
        _pause(rng, 0.9 * seconds, 1.1 * seconds)
        link.pass_on()

    return inject


def _flaps(link: TcpProxy) -> None:
    for _ in range(20):
        link.cut()
        time.sleep(0.5)


NETWORKS: dict[str, tuple[Callable[[TcpProxy], None], float]] = {
    "cut": (TcpProxy.cut, 0.0),
    "cut every 0.5 s for 10 s": (_flaps, 0.0),
    "refused for 10 s": (TcpProxy.refuse, 10.0),
    "refused for 60 s": (TcpProxy.refuse, 60.0),
    "slow by 1.5 s for 30 s": (lambda link: link.delay(1.5), 30.0),
    "silent for 10 s": (TcpProxy.blackhole, 10.0),
    "silent for 60 s": (TcpProxy.blackhole, 60.0),
    "without answers for 10 s": (lambda link: link.blackhole("answers"), 10.0),
    "without requests for 10 s": (lambda link: link.blackhole("requests"), 10.0),
    "forgotten connections": (TcpProxy.abandon, 0.0),
}
for _what, (_change, _seconds) in NETWORKS.items():
    _add(f"network of a worker: {_what}", _network("worker", _change, _seconds))
    _add(f"network of the service: {_what}", _network("service", _change, _seconds))


# The host of a worker: the kernel learns of the fault as it does when a cable, a switch or a firewall fails


def _host(change: Callable[[NetworkHost], None], seconds: float) -> Injection:
    def inject(parts: Parts, job_id: str, rng: Random) -> None:
        link = _link_of(rng.choice(parts.workers))
        change(link)
        _pause(rng, 0.9 * seconds, 1.1 * seconds)
        link.pass_on()

    return inject


HOSTS: dict[str, tuple[Callable[[NetworkHost], None], float]] = {
    "its link down for 10 s": (NetworkHost.down, 10.0),
    "its link down for 60 s": (NetworkHost.down, 60.0),
    "silent for 60 s": (NetworkHost.lose, 60.0),
    "its requests lost for 10 s": (lambda link: link.lose("requests"), 10.0),
    "its requests lost for 60 s": (lambda link: link.lose("requests"), 60.0),
    "its answers lost for 10 s": (lambda link: link.lose("answers"), 10.0),
    "its answers lost for 60 s": (lambda link: link.lose("answers"), 60.0),
    "every third packet lost for 30 s": (lambda link: link.lose(every=3), 30.0),
    "slow by 1.5 s for 30 s": (lambda link: link.delay(1.5), 30.0),
    "another address": (NetworkHost.change_address, 0.0),
}
for _what, (_alter, _seconds) in HOSTS.items():
    _add(f"host of a worker: {_what}", _host(_alter, _seconds), hosts=True)


@_kind("host of a worker: cut for good", hosts=True, recovers_within_s=60.0)
def _host_cut(parts: Parts, job_id: str, rng: Random) -> float:
    worker = rng.choice(parts.workers)
    recovered_s = cut_off(parts, job_id, worker, _link_of(worker).lose)
    until(lambda: parts.client.job(job_id).status in ENDED_JOBS, within_s=600.0)
    return recovered_s


@_kind("host of a worker: without power, starts again with another address", hosts=True, recovers_within_s=60.0)
def _host_without_power(parts: Parts, job_id: str, rng: Random) -> float:
    worker = rng.choice(parts.workers)
    link = _link_of(worker)

    def end() -> None:
        link.lose()  # The broker never learns that the connections are gone.
        worker.kill_all()

    recovered_s = cut_off(parts, job_id, worker, end)
    link.change_address()
    link.pass_on()
    worker.start()
    return recovered_s


def cut_off(parts: Parts, job_id: str, worker: Part, cut: Callable[[], None]) -> float:
    """Cut a worker off; return the seconds until none of the tasks that it had is still with it.

    Another worker has it then, or it is done by the tile that the worker stored.
    """

    def running() -> set[str]:
        return {task.id for task in parts.client.tasks(job_id, status="running") if task.worker == worker.name}

    until(running)
    cut()
    cut_s, lost = time.monotonic(), running()
    until(lambda: not lost & running())
    return time.monotonic() - cut_s


def _link_of(worker: Part) -> NetworkHost:
    assert isinstance(worker.link, NetworkHost)
    return worker.link


# Disk and database


def _damaged(damage: Damage, pattern: str) -> Injection:
    def inject(parts: Parts, job_id: str, rng: Random) -> None:
        folder = parts.data_dir / "artifacts" / job_id
        files = until(lambda: sorted(folder.glob(pattern)), within_s=400.0)
        damage(rng.choice(files))

    return inject


for _damage in DAMAGES:
    _add(f"disk: a tile, {_damage.__name__}", _damaged(_damage, "**/tiles/**/*.exr"))
    _add(f"disk: a master, {_damage.__name__}", _damaged(_damage, "orthoscopic/*.exr"), damages=True)


@_kind("disk: the scratch of a worker deleted")
def _scratch_deleted(parts: Parts, job_id: str, rng: Random) -> None:
    files = until(lambda: [path for path in (parts.data_dir / "scratch").rglob("*") if path.is_file()])
    for path in files:
        path.unlink(missing_ok=True)


@_kind("disk: the store read-only for 10 s")
def _store_read_only(parts: Parts, job_id: str, rng: Random) -> None:
    with read_only(parts.data_dir / "artifacts"):
        _pause(rng, 9.0, 11.0)


@_kind("disk: the store away for 10 s")
def _store_away(parts: Parts, job_id: str, rng: Random) -> None:
    with away(parts.data_dir / "artifacts"):
        _pause(rng, 9.0, 11.0)


@_kind("database: locked by another process for 20 s")
def _locked(parts: Parts, job_id: str, rng: Random) -> None:
    with closing(sqlite3.connect(parts.data_dir / "lippmann.db", timeout=60.0, isolation_level=None)) as connection:
        connection.execute("BEGIN IMMEDIATE")
        _pause(rng, 19.0, 21.0)
        connection.execute("ROLLBACK")


# Users


@_kind("user: pauses and resumes five times")
def _paused(parts: Parts, job_id: str, rng: Random) -> None:
    for _ in range(5):
        parts.client.pause(job_id)
        _pause(rng, 0.0, 3.0)
        parts.client.resume(job_id)
        _pause(rng, 0.0, 3.0)


@_kind("user: cancels and retries")
def _cancelled(parts: Parts, job_id: str, rng: Random) -> None:
    parts.client.cancel(job_id)
    until(lambda: parts.client.job(job_id).status == "cancelled")
    parts.client.retry(job_id)


@_kind("user: a second job comes before it, is cancelled and removed")
def _second_job(parts: Parts, job_id: str, rng: Random) -> None:
    other = parts.client.submit(small_job("fish", frames="1-3", priority=90))
    _pause(rng, 0.0, 8.0)
    if "cancel" in parts.client.job(other.id).actions:
        parts.client.cancel(other.id)
    until(lambda: parts.client.job(other.id).status in ("cancelled", "done"))
    parts.client.delete(other.id)


def _signal(pid: int, number: signal.Signals) -> None:
    with suppress(ProcessLookupError):  # it has ended meanwhile
        os.kill(pid, number)
