"""A farm of seven hosts that loses a worker for good and its database for a while: kinds of `make chaos` in short."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.chaos.kinds.kind import Work
from tests.chaos.kinds.worker_hosts import cut_off
from tests.chaos.seven_hosts import seven_hosts
from tests.chaos.trial import undisturbed, wrong_with
from tests.farm import ended
from tests.needs import needs_povray
from tests.network_host import why_no_network_host
from tests.outages import QUICK
from tests.waiting import halt, until

pytestmark = pytest.mark.skipif(bool(reason := why_no_network_host()), reason=str(reason))

WORK = Work(frames=1, lenses=40, tiles=3)
TWO_HEARTBEATS = {"LIPPMANN_LEASE_TTL_S": "10"}
"""The least that `lippmann doctor` takes."""


@needs_povray
def test_a_job_ends_right_whose_worker_is_cut_off_for_good_and_whose_database_for_a_while(tmp_path: Path) -> None:
    pixels = undisturbed(WORK, tmp_path / "undisturbed")
    with seven_hosts(tmp_path, env=QUICK | TWO_HEARTBEATS) as farm:
        job = farm.client.submit(WORK.spec(f"1-{WORK.frames}"))
        until(lambda: farm.client.job(job.id).status == "running")
        cut = until(lambda: next((worker for worker in farm.workers if worker.below("povray")), None))
        halt(until(lambda: cut.below("povray"))[0])  # It does not store the tile after the cut.
        cut_off(farm, job.id, cut, farm.hosts[cut.name].lose)
        farm.hosts["database"].lose()
        until(lambda: not farm.client.health().database.ok)
        farm.hosts["database"].pass_on()
        job = ended(farm.client, job.id)
        again = {task.worker for task in farm.client.tasks(job.id) if task.losses}
        assert again
        assert cut.name not in again
        cut.kill_all()
        farm.hosts[cut.name].change_address()
        farm.heal()
        assert wrong_with(farm, job, WORK, pixels) == []
