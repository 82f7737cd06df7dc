"""Outages of the broker: the job ends with each frame once, and the worker takes orders again (`make outages`).

Each case is a farm of its own, a job in its slots or none, and an outage of some kind and length.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.farm.supervisor.descendants import descendants
from tests.farm import ENDED, ended, until
from tests.needs import needs_povray
from tests.outages import (
    OutageFarm,
    assert_each_frame_is_there_once,
    fish,
    one_machine_farm,
    rendering,
    separate_farm,
    undisturbed_frame,
)

pytestmark = [needs_povray, pytest.mark.long]

OUTAGE_S = 1200.0
"""A limit for a job with an outage of five minutes in it."""


@dataclass(frozen=True)
class Outage:
    """The beginning and the end of an outage."""

    begin: Callable[[OutageFarm], None]
    end: Callable[[OutageFarm], None]


def _restart_empty(farm: OutageFarm) -> None:
    assert farm.broker is not None
    farm.broker.start()


def _broker(name: str) -> Callable[[OutageFarm], None]:
    def change(farm: OutageFarm) -> None:
        assert farm.broker is not None
        getattr(farm.broker, name)()

    return change


def _back(farm: OutageFarm) -> None:
    farm.proxy.pass_on()


OUTAGES = {
    "refused": Outage(lambda farm: farm.proxy.refuse(), _back),
    "blackhole": Outage(lambda farm: farm.proxy.blackhole(), _back),
    "answers lost": Outage(lambda farm: farm.proxy.blackhole("answers"), _back),
    "requests lost": Outage(lambda farm: farm.proxy.blackhole("requests"), _back),
    "slow": Outage(lambda farm: farm.proxy.delay(2.0), _back),
    "forgotten": Outage(lambda farm: farm.proxy.abandon(), lambda farm: None),
    "stopped": Outage(_broker("freeze"), _broker("thaw")),
    "emptied": Outage(_broker("kill"), _restart_empty),
}
LENGTHS_S = (1, 10, 60, 75, 300)
FARMS = {"separate": separate_farm, "up": one_machine_farm}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> NDArray[np.float16]:
    return undisturbed_frame(tmp_path_factory.mktemp("undisturbed"))


def go_through(
    farm: OutageFarm, outage: Outage, length_s: float, undisturbed: NDArray[np.float16], *, busy: bool
) -> float:
    """Go through an outage; return the seconds until the worker takes an order afterwards, which a report may list."""
    frames = "1-3"
    if busy:
        job = farm.client.submit(fish(frames))
        until(farm.client, job.id, rendering)
    outage.begin(farm)
    time.sleep(length_s)  # the length of the outage is what is tried
    outage.end(farm)
    if busy and farm.client.job(job.id).status in ENDED:  # New connections worked, so nothing is left to take.
        assert_each_frame_is_there_once(farm, farm.client.job(job.id), undisturbed)
        busy = False
    if not busy:
        job = farm.client.submit(fish(frames))
    taken_s = farm.seconds_until_an_order_is_taken()
    assert_each_frame_is_there_once(farm, ended(farm.client, job.id, within_s=OUTAGE_S), undisturbed)
    return taken_s


@pytest.mark.parametrize("busy", [True, False], ids=["busy", "idle"])
@pytest.mark.parametrize("length_s", LENGTHS_S)
@pytest.mark.parametrize("kind", FARMS)
def test_a_broker_that_refuses_connections(
    tmp_path: Path, undisturbed: NDArray[np.float16], request: pytest.FixtureRequest,
    kind: str, length_s: float, busy: bool,
) -> None:  # fmt: skip
    with FARMS[kind](tmp_path) as farm:
        taken_s = go_through(farm, OUTAGES["refused"], length_s, undisturbed, busy=busy)
    request.node.user_properties.append(("taken_s", taken_s))


@pytest.mark.parametrize("busy", [True, False], ids=["busy", "idle"])
@pytest.mark.parametrize("length_s", [10, 75])
@pytest.mark.parametrize("name", [name for name in OUTAGES if name != "refused"])
def test_a_broker_or_network_that_fails_in_another_way(
    tmp_path: Path, undisturbed: NDArray[np.float16], request: pytest.FixtureRequest,
    name: str, length_s: float, busy: bool,
) -> None:  # fmt: skip
    with separate_farm(tmp_path) as farm:
        taken_s = go_through(farm, OUTAGES[name], length_s, undisturbed, busy=busy)
    request.node.user_properties.append(("taken_s", taken_s))


def test_a_broker_that_is_restarted_empty_every_20_seconds(tmp_path: Path, undisturbed: NDArray[np.float16]) -> None:
    with separate_farm(tmp_path) as farm:
        assert farm.broker is not None
        job = farm.client.submit(fish("1-30"))
        until(farm.client, job.id, rendering)
        for _ in range(9):
            time.sleep(20.0)
            farm.broker.kill()
            farm.broker.start()
        assert_each_frame_is_there_once(farm, ended(farm.client, job.id, within_s=OUTAGE_S), undisturbed)


def test_a_pool_process_that_is_killed_in_an_outage(tmp_path: Path, undisturbed: NDArray[np.float16]) -> None:
    with separate_farm(tmp_path) as farm:
        job = farm.client.submit(fish("1-3"))
        until(farm.client, job.id, rendering)
        farm.proxy.refuse()
        for pid in descendants(farm.worker_pid()):
            if Path(f"/proc/{pid}/comm").read_text().strip() == "povray":
                parent = int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
                os.kill(parent, signal.SIGKILL)
        time.sleep(15.0)
        farm.proxy.pass_on()
        assert_each_frame_is_there_once(farm, ended(farm.client, job.id, within_s=OUTAGE_S), undisturbed)
