"""Workers take orders again when the broker is back. The long forms are in tests/chaos/test_outages.py."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.farm import ended, until
from tests.integration.lippmann.conftest import alive, born
from tests.needs import needs_povray
from tests.outages import (
    QUICK,
    assert_each_frame_is_there_once,
    fish,
    one_machine_farm,
    rendering,
    separate_farm,
    undisturbed_frame,
)
from tests.waiting import until as wait_until

pytestmark = needs_povray

FORGETFUL = {**QUICK, "LIPPMANN_FINAL_EVENT_S": "1"}
"""Attempts that end during the outage lose their final event, as they do in an outage of more than ten minutes."""


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> NDArray[np.float16]:
    return undisturbed_frame(tmp_path_factory.mktemp("undisturbed"))


def test_a_worker_whose_attempts_all_ended_while_the_broker_was_away_takes_orders_again(
    tmp_path: Path, undisturbed: NDArray[np.float16]
) -> None:
    with separate_farm(tmp_path, env=FORGETFUL) as farm:
        job = farm.client.submit(fish("1-2"))
        until(farm.client, job.id, rendering)
        farm.proxy.refuse()
        wait_until(lambda: farm.worker_log.read_text().count("final event lost") == 2)
        wait_until(lambda: _has_noticed(farm.worker_log.read_text()))
        farm.proxy.pass_on()
        assert_each_frame_is_there_once(farm, ended(farm.client, job.id), undisturbed)


def test_a_worker_that_keeps_final_events_in_an_outage_stops_when_it_is_told_to(tmp_path: Path) -> None:
    with separate_farm(tmp_path) as farm:
        # With one frame, a tile may have ended before the other one begins.
        job = farm.client.submit(fish("1-4"))
        until(farm.client, job.id, rendering)
        worker = born(farm.worker_pid())
        assert worker is not None
        farm.proxy.blackhole()
        os.kill(worker[0], signal.SIGTERM)
        wait_until(lambda: not alive({worker}))


def test_a_worker_notices_that_the_network_has_forgotten_its_connections(
    tmp_path: Path, undisturbed: NDArray[np.float16]
) -> None:
    with one_machine_farm(tmp_path, env=QUICK) as farm:
        farm.proxy.abandon()
        job = farm.client.submit(fish("1"))
        wait_until(lambda: "expected an answer of the broker within" in farm.worker_log.read_text())
        assert_each_frame_is_there_once(farm, ended(farm.client, job.id), undisturbed)


def _has_noticed(log: str) -> bool:
    """Return whether the worker has met the outage: as a poll, or as acknowledgements, which it once sent and lost."""
    return "the broker does not answer" in log or log.count("Couldn't ack") == 2
