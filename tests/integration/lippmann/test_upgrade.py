"""A farm of an older version, killed in the middle of a job, goes on with this version; see `old_farm.py`."""

from __future__ import annotations

import sqlite3
import tarfile
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from tests.farm import ended, farm_up
from tests.integration.lippmann.conftest import run
from tests.needs import needs_povray

NEWEST = "0009"
ENVIRONMENT = {"LIPPMANN_LEASE_TTL_S": "8"}
"""Nothing but the silence is known of the attempts of an older worker, and a test does not wait for 45 s."""


def _tasks(data: Path) -> dict[int, dict[str, Any]]:
    with closing(sqlite3.connect(data / "lippmann.db")) as connection:
        connection.row_factory = sqlite3.Row
        return {row["sequence"]: dict(row) for row in connection.execute("SELECT * FROM tasks")}


def unpacked(revision: str, folder: Path) -> Path:
    """Unpack the farm of an older version, and return its data folder."""
    data = folder / "data"
    data.mkdir()
    with tarfile.open(Path(__file__).with_name(f"old_farm_{revision}.tar.xz")) as archive:
        archive.extractall(data, filter="data")
    return data


@needs_povray
@pytest.mark.parametrize("revision", [pytest.param("0002", marks=pytest.mark.long), NEWEST])
def test_a_job_of_an_older_version_ends_with_every_frame_rendered_once(tmp_path: Path, revision: str) -> None:
    data = unpacked(revision, tmp_path)
    before = _tasks(data)
    done = {number for number, task in before.items() if task["status"] == "done"}
    held = {number for number, task in before.items() if task["status"] in ("running", "dispatched")}
    assert len(done) >= 3
    assert held
    with farm_up(data, env=ENVIRONMENT) as farm:
        (job,) = farm.client.jobs()
        assert ended(farm.client, job.id).status == "done"
        names = {artifact.name for artifact in farm.client.artifacts(job.id, prefix="integral/")}
    assert names == {f"integral/{frame:04}.exr" for frame in range(1, job.frames_total + 1)}
    after = _tasks(data)
    assert {task["status"] for task in after.values()} == {"done"}
    assert {number for number in done if after[number]["attempt"] != before[number]["attempt"]} == set()
    assert {number for number, task in after.items() if task["attempt_number"] > 1} <= held
    doctor = run("doctor", "--deep", "--data-dir", str(data))
    assert (doctor.returncode, doctor.stdout.splitlines()[-1]) == (0, "Nothing is wrong.")
