"""Faults of the host of a worker.

The kernel learns of the fault as it does when a cable, a switch or a firewall fails.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from random import Random

from lippmann.job.states import ENDED_JOBS
from tests.chaos.kinds.kind import Injection, Kinds, pause
from tests.chaos.parts import Part, Parts
from tests.network_host import NetworkHost
from tests.waiting import until

KINDS = Kinds()


def _host(change: Callable[[NetworkHost], None], seconds: float) -> Injection:
    def inject(parts: Parts, job_id: str, rng: Random) -> None:
        link = _link_of(rng.choice(parts.workers))
        change(link)
        pause(rng, 0.9 * seconds, 1.1 * seconds)
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
    KINDS.add(f"host of a worker: {_what}", _host(_alter, _seconds), hosts=True)


@KINDS.of("host of a worker: cut for good", hosts=True, recovers_within_s=60.0)
def _host_cut(parts: Parts, job_id: str, rng: Random) -> float:
    worker = rng.choice(parts.workers)
    recovered_s = cut_off(parts, job_id, worker, _link_of(worker).lose)
    until(lambda: parts.client.job(job_id).status in ENDED_JOBS, within_s=600.0, every_s=0.1)
    return recovered_s


@KINDS.of("host of a worker: without power, starts again with another address", hosts=True, recovers_within_s=60.0)
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
