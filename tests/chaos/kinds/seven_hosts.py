"""Faults between seven hosts: service, database, broker, store and three workers."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from lippmann.job.states import ENDED_JOBS
from tests.chaos.kinds.kind import Kinds, Work, pause
from tests.chaos.kinds.worker_hosts import cut_off
from tests.chaos.parts import Parts
from tests.chaos.seven_hosts import SERVERS, SevenHosts
from tests.network_host import NetworkHost
from tests.waiting import until

KINDS = Kinds()
WORK = Work(frames=6, lenses=40, tiles=2)


def _add(name: str, change: Callable[[SevenHosts, Random], NetworkHost], low_s: float, high_s: float) -> None:
    """Add a kind that changes the link of a host for a while."""

    def inject(parts: Parts, job_id: str, rng: Random) -> None:
        host = change(_seven(parts), rng)
        pause(rng, low_s, high_s)
        host.pass_on()

    KINDS.add(f"seven hosts: {name}", inject, seven=True, work=WORK)


@KINDS.of("seven hosts: nothing fails", seven=True, work=WORK)
def _nothing(parts: Parts, job_id: str, rng: Random) -> None:
    """Let the job end by itself."""


def _cut(server: str) -> Callable[[SevenHosts, Random], NetworkHost]:
    def cut(farm: SevenHosts, rng: Random) -> NetworkHost:
        farm.hosts[server].lose()
        return farm.hosts[server]

    return cut


for _server in SERVERS:
    _add(f"the {_server} cut for 20 to 60 s", _cut(_server), 20.0, 60.0)


def _requests_to_database(farm: SevenHosts, rng: Random) -> NetworkHost:
    farm.hosts["service"].lose("requests", peer=farm.hosts["database"])
    return farm.hosts["service"]


def _answers_of_database(farm: SevenHosts, rng: Random) -> NetworkHost:
    farm.hosts["service"].lose("answers", peer=farm.hosts["database"])
    return farm.hosts["service"]


def _requests_to_store(farm: SevenHosts, rng: Random) -> NetworkHost:
    worker = farm.hosts[rng.choice(farm.workers).name]
    worker.lose("requests", peer=farm.hosts["store"])
    return worker


def _tenth_packets(farm: SevenHosts, rng: Random) -> NetworkHost:
    for host in farm.hosts.values():
        host.lose("requests", every=10)
    return farm.hosts["service"]


def _slow_store(farm: SevenHosts, rng: Random) -> NetworkHost:
    farm.hosts["store"].throttle(delay_s=0.2, bits_per_s=1e6)
    return farm.hosts["store"]


_add("packets of the service to the database lost for 40 s", _requests_to_database, 36.0, 44.0)
_add("packets of the database to the service lost for 40 s", _answers_of_database, 36.0, 44.0)
_add("packets of a worker to the store lost for 40 s", _requests_to_store, 36.0, 44.0)
_add("every tenth packet of all lost for 60 s", _tenth_packets, 54.0, 66.0)
_add("the store slow by 200 ms and with 1 Mbit/s for 60 s", _slow_store, 54.0, 66.0)


@KINDS.of("seven hosts: a worker cut for good", seven=True, work=WORK, recovers_within_s=60.0)
def _worker_cut(parts: Parts, job_id: str, rng: Random) -> float:
    worker = rng.choice(parts.workers)
    recovered_s = cut_off(parts, job_id, worker, _seven(parts).hosts[worker.name].lose)
    until(lambda: parts.client.job(job_id).status in ENDED_JOBS, within_s=600.0, every_s=0.1)
    return recovered_s


def _seven(parts: Parts) -> SevenHosts:
    assert isinstance(parts, SevenHosts)
    return parts
