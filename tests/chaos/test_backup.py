"""A backup of a farm in mid-job: the farm is lost, and another one that is restored from it ends the job."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.chaos.test_kill import QUICK, assert_all_there_once, first_frame, fish, rendering
from tests.chaos.test_kill import undisturbed as undisturbed
from tests.farm import ended, farm_up, until
from tests.integration.lippmann.conftest import run
from tests.integration.service.conftest import postgresql as postgresql
from tests.integration.service.test_backup import new_postgresql
from tests.needs import needs_povray

pytestmark = needs_povray


@pytest.mark.parametrize("kind", ["sqlite", "postgresql"])
def test_a_restored_farm_ends_the_job_with_the_same_pixels(
    tmp_path: Path, undisturbed: NDArray[np.float16], kind: str, request: pytest.FixtureRequest
) -> None:
    before, after = {}, {}
    if kind == "postgresql":
        server = request.getfixturevalue("postgresql")
        before, after = ({"LIPPMANN_DATABASE_URL": new_postgresql(server, name)} for name in ("before", "after"))
    with farm_up(tmp_path / "before", env=QUICK | before) as farm:
        job = farm.client.submit(fish("1-8"))  # the backup comes before its end, also on a busy machine
        until(farm.client, job.id, lambda job: rendering(job) and job.frames_done)
        made = _command("backup", tmp_path / "backup", tmp_path / "before", before)
        farm.kill()
    restored = _command("restore", tmp_path / "backup", tmp_path / "after", after)
    assert restored["rows"] == made["rows"]
    assert restored["tasks_taken_back"] > 0
    with farm_up(tmp_path / "after", env=QUICK | after) as farm:
        was = farm.client.job(job.id)
        assert (was.status, was.frames_done > 0) == ("running", True)
        job = ended(farm.client, job.id)
        assert_all_there_once(farm, job)
        assert (first_frame(farm, job) == undisturbed).all()


def _command(name: str, backup: Path, data_dir: Path, environment: dict[str, str]) -> Any:
    ran = run(name, str(backup), "--data-dir", str(data_dir), "--json", **environment)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)
