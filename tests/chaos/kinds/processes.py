"""Faults of processes: workers, POV-Ray, the service and all of them are killed, stopped and ended."""

from __future__ import annotations

import os
import signal
from contextlib import suppress
from random import Random

from lippmann.job.states import ENDED_JOBS
from tests.chaos.kinds.kind import LONG, Injection, Kinds, pause
from tests.chaos.kinds.worker_hosts import cut_off
from tests.chaos.parts import Part, Parts
from tests.waiting import until

KINDS = Kinds()


def _restart(parts: Parts, part: Part, rng: Random, *, after_s: tuple[float, float] = (0.0, 1.0)) -> None:
    part.kill()
    pause(rng, *after_s)
    part.start()


@KINDS.of("worker: killed, starts again at once")
def _worker_killed(parts: Parts, job_id: str, rng: Random) -> None:
    _restart(parts, rng.choice(parts.workers), rng)


@KINDS.of("worker: killed, starts again after 20 s")
def _worker_killed_long(parts: Parts, job_id: str, rng: Random) -> None:
    _restart(parts, rng.choice(parts.workers), rng, after_s=(19.0, 21.0))


@KINDS.of("worker: killed, never comes back")
def _worker_gone(parts: Parts, job_id: str, rng: Random) -> float:
    worker = rng.choice(parts.workers)
    recovered_s = cut_off(parts, job_id, worker, worker.kill)
    until(lambda: parts.client.job(job_id).status != "running", within_s=600.0, every_s=0.1)
    return recovered_s


@KINDS.of("worker: both killed")
def _workers_killed(parts: Parts, job_id: str, rng: Random) -> None:
    for worker in parts.workers:
        worker.kill()
    pause(rng, 0.0, 5.0)


@KINDS.of("worker: terminated, starts again")
def _worker_terminated(parts: Parts, job_id: str, rng: Random) -> None:
    worker = rng.choice(parts.workers)
    worker.terminate()
    worker.start()


def _stopped(part: Part, low_s: float, high_s: float, rng: Random) -> None:
    part.send(signal.SIGSTOP)
    pause(rng, low_s, high_s)
    part.send(signal.SIGCONT)


@KINDS.of("worker: stands still for 8 s")
def _worker_stopped(parts: Parts, job_id: str, rng: Random) -> None:
    _stopped(rng.choice(parts.workers), 7.0, 9.0, rng)


@KINDS.of("worker: it and all below it stand still for 60 s")
def _worker_stopped_long(parts: Parts, job_id: str, rng: Random) -> None:
    worker = rng.choice(parts.workers)
    stopped = [worker.pid, *worker.below("lippmann"), *worker.pool(), *worker.below("povray")]
    for pid in stopped:
        _signal(pid, signal.SIGSTOP)
    pause(rng, 58.0, 62.0)
    for pid in stopped:
        _signal(pid, signal.SIGCONT)


@KINDS.of("worker: its pool process killed")
def _pool_killed(parts: Parts, job_id: str, rng: Random) -> None:
    worker = rng.choice(parts.workers)
    _signal(until(worker.pool)[0], signal.SIGKILL)


@KINDS.of("worker: its pool process stands still for 60 s")
def _pool_stopped(parts: Parts, job_id: str, rng: Random) -> None:
    pid = until(rng.choice(parts.workers).pool)[0]
    _signal(pid, signal.SIGSTOP)
    pause(rng, 58.0, 62.0)
    _signal(pid, signal.SIGCONT)


def _to_povray(number: signal.Signals) -> Injection:
    def inject(parts: Parts, job_id: str, rng: Random) -> None:
        worker = rng.choice(parts.workers)
        _signal(until(lambda: worker.below("povray"))[0], number)

    return inject


for _number in (signal.SIGKILL, signal.SIGSEGV, signal.SIGTERM, signal.SIGABRT):
    KINDS.add(f"povray: {_number.name}", _to_povray(_number))


@KINDS.of("povray: stands still for 10 s")
def _povray_stopped(parts: Parts, job_id: str, rng: Random) -> None:
    worker = rng.choice(parts.workers)
    pid = until(lambda: worker.below("povray"))[0]
    _signal(pid, signal.SIGSTOP)
    pause(rng, 9.0, 11.0)
    _signal(pid, signal.SIGCONT)


@KINDS.of("service: killed, starts again")
def _service_killed(parts: Parts, job_id: str, rng: Random) -> None:
    _restart(parts, parts.service, rng, after_s=(0.0, 5.0))


@KINDS.of("service: killed five times, 3 s apart")
def _service_killed_often(parts: Parts, job_id: str, rng: Random) -> None:
    for _ in range(5):
        _restart(parts, parts.service, rng)
        pause(rng, 2.0, 4.0)


@KINDS.of("service: terminated, starts again")
def _service_terminated(parts: Parts, job_id: str, rng: Random) -> None:
    parts.service.terminate()
    parts.service.start()


@KINDS.of("service: stands still for 10 s")
def _service_stopped(parts: Parts, job_id: str, rng: Random) -> None:
    _stopped(parts.service, 9.0, 11.0, rng)


@KINDS.of("service: stands still for 60 s")
def _service_stopped_long(parts: Parts, job_id: str, rng: Random) -> None:
    _stopped(parts.service, 58.0, 62.0, rng)


@KINDS.of("all: every process killed, starts again")
def _all_killed(parts: Parts, job_id: str, rng: Random) -> None:
    for part in rng.sample(parts.processes, len(parts.processes)):
        part.kill()
    pause(rng, 0.0, 5.0)


@KINDS.of("all: every process and the broker killed, starts again")
def _all_and_broker_killed(parts: Parts, job_id: str, rng: Random) -> None:
    for part in rng.sample(parts.processes, len(parts.processes)):
        part.kill()
    parts.broker.kill()
    pause(rng, 0.0, 5.0)


@KINDS.of("all: 59 SIGKILLs to random processes")
def _kills(parts: Parts, job_id: str, rng: Random) -> None:
    for _ in range(59):
        rng.choice(parts.processes).kill_one(rng)
        pause(rng, 0.2, 1.5)
        for part in parts.processes:
            part.start()


@KINDS.of("all: a SIGKILL every 10 s, while 1,000 frames render", work=LONG)
def _kills_all_along(parts: Parts, job_id: str, rng: Random) -> None:
    # The video takes longer than the pause between two kills, and a task that is lost ten times is not tried again.
    while (job := parts.client.job(job_id)).status not in ENDED_JOBS and job.frames_done < job.frames_total:
        rng.choice(parts.processes).kill_one(rng)
        pause(rng, 0.0, 1.0)
        for part in parts.processes:
            part.start()
        pause(rng, 9.0, 10.0)


def _signal(pid: int, number: signal.Signals) -> None:
    with suppress(ProcessLookupError):  # it has ended meanwhile
        os.kill(pid, number)
