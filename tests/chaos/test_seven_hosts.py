"""A farm of seven hosts whose database is cut off in mid-job: the short form of kinds of `make chaos`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.chaos.kinds.kind import Work
from tests.chaos.seven_hosts import seven_hosts
from tests.chaos.trial import undisturbed, wrong_with
from tests.farm import ended
from tests.needs import needs_povray
from tests.network_host import why_no_network_host
from tests.waiting import until

pytestmark = [
    needs_povray,
    pytest.mark.long,
    pytest.mark.skipif(bool(reason := why_no_network_host()), reason=str(reason)),
]

WORK = Work(frames=2, lenses=24, tiles=2)


def test_a_job_ends_right_whose_database_is_cut_off_for_a_while(tmp_path: Path) -> None:
    pixels = undisturbed(WORK, tmp_path / "undisturbed")
    with seven_hosts(tmp_path) as farm:
        job = farm.client.submit(WORK.spec(f"1-{WORK.frames}"))
        until(lambda: farm.client.job(job.id).tasks.running)
        farm.hosts["database"].lose()
        until(lambda: not farm.client.health().database.ok)
        farm.heal()
        job = ended(farm.client, job.id)
        assert wrong_with(farm, job, WORK, pixels) == []
