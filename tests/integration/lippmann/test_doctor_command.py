"""The command `doctor` against a farm that runs, and against one that is broken by hand."""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from tests.integration.lippmann.conftest import Up, run
from tests.needs import needs_povray
from tests.waiting import until


def test_nothing_is_wrong_with_a_farm_that_runs(farm: Up) -> None:
    ran = run("doctor", "--deep", "--data-dir", str(farm.data_dir))
    assert ran.returncode == 0
    assert re.search(r"^note: sandbox: a worker started here runs ", ran.stdout, re.MULTILINE)
    assert all(line.startswith("note: ") for line in ran.stdout.splitlines()[:-1])
    assert ran.stdout.endswith("\nNothing is wrong.\n")


def test_a_machine_whose_workers_have_no_sandbox_is_warned_about(farm: Up) -> None:
    ran = run("doctor", "--data-dir", str(farm.data_dir), LIPPMANN_SANDBOX="none")
    assert (ran.returncode, "warning: sandbox: LIPPMANN_SANDBOX is none" in ran.stdout) == (1, True)


@needs_povray
def test_what_is_wrong_is_printed_and_repaired(farm: Up, tmp_path: Path) -> None:
    with farm.client() as client:
        job = client.submit({"scene": "target-white", "frames": "1", "rig": {"lens_array": {"count": [4, 4]}}})
        until(lambda: client.job(job.id).status == "done")
    backup, data = tmp_path / "backup", tmp_path / "data"
    assert run("backup", str(backup), "--data-dir", str(farm.data_dir)).returncode == 0
    assert run("restore", str(backup), "--data-dir", str(data)).returncode == 0
    with closing(sqlite3.connect(data / "lippmann.db")) as connection:
        connection.execute("UPDATE jobs SET done = 77 WHERE id = ?", (job.id,))
        connection.commit()
    ran = run("doctor", "--data-dir", str(data))
    assert ran.returncode == 1
    assert f"error: counters: job {job.id}: the counters differ from the tasks: done 77 instead of" in ran.stdout
    assert ran.stdout.endswith("Findings: 1. `lippmann doctor --repair` can repair 1 of them.\n")
    repaired = run("doctor", "--repair", "--json", "--data-dir", str(data))
    answer = json.loads(repaired.stdout)
    assert (repaired.returncode, answer["healthy"], _bad(answer)) == (0, True, [])
    assert [(one["check"], one["job"]) for one in answer["repaired"]] == [("counters", job.id)]
    shutil.rmtree(data / "artifacts" / job.id)
    ran = run("doctor", "--json", "--data-dir", str(data))
    (finding,) = _bad(json.loads(ran.stdout))
    assert (ran.returncode, finding["check"], finding["level"]) == (1, "artifacts", "error")
    (data / "artifacts" / ".store").unlink()
    ran = run("doctor", "--json", "--data-dir", str(data))
    assert [one["check"] for one in _bad(json.loads(ran.stdout))] == ["store"]
    ran = run("doctor", "--adopt-store", "--json", "--data-dir", str(data))
    assert [one["check"] for one in _bad(json.loads(ran.stdout))] == ["artifacts"]


def _bad(answer: dict[str, Any]) -> list[dict[str, Any]]:
    return [one for one in answer["findings"] if one["level"] != "note"]


@pytest.mark.parametrize("content", [None, b"not a database, and long enough to be read as one"])
def test_what_is_no_farm_is_refused_and_what_is_no_database_is_found(tmp_path: Path, content: bytes | None) -> None:
    ran = run("doctor", "--data-dir", str(tmp_path))
    assert (ran.returncode, ran.stdout, "without artifacts/" in ran.stderr) == (2, "", True)
    (tmp_path / "artifacts").mkdir()
    if content is None:
        ran = run("doctor", "--data-dir", str(tmp_path))
        assert (ran.returncode, "got no" in ran.stderr) == (2, True)
        assert not (tmp_path / "lippmann.db").exists()
    else:
        (tmp_path / "lippmann.db").write_bytes(content)
        ran = run("doctor", "--data-dir", str(tmp_path))
        assert (ran.returncode, "error: integrity: the database cannot be read" in ran.stdout) == (1, True)


def test_beside_a_worker_of_a_cluster_the_machine_and_the_ways_of_the_worker_are_examined(tmp_path: Path) -> None:
    words, bucket = ("doctor", "--data-dir", str(tmp_path)), {"LIPPMANN_STORE_URL": "s3://farm/lippmann"}
    bucket |= {"LIPPMANN_S3_ENDPOINT": "http://127.0.0.1:1", "HOME": str(tmp_path), "AWS_EC2_METADATA_DISABLED": "true"}
    bucket |= {"AWS_ACCESS_KEY_ID": "", "AWS_SECRET_ACCESS_KEY": ""}
    ran = run(*words, "--json", **bucket)
    checks = {one["check"]: one for one in json.loads(ran.stdout)["findings"]}
    assert "with the settings of the service examines the farm" in checks["farm"]["message"]
    assert {"povray", "sandbox", "broker"} <= checks.keys()
    assert (ran.returncode, checks["store"]["level"]) == (1, "error")
    assert "bucket farm at http://127.0.0.1:1: there is no access key" in checks["store"]["message"]
    assert not {"integrity", "settings"} & checks.keys()
    ran = run(*words, "--repair", **bucket)
    assert (ran.returncode, "expected LIPPMANN_DATABASE_URL or a database in" in ran.stderr) == (2, True)
    ran = run(*words, **bucket, LIPPMANN_DATABASE_URL=f"sqlite:///{tmp_path}/none.db")
    assert (ran.returncode, "examines the farm" in ran.stdout) == (2, False)


def test_an_empty_setting_names_no_farm(tmp_path: Path) -> None:
    ran = run("doctor", "--data-dir", str(tmp_path), LIPPMANN_STORE_URL="")
    assert (ran.returncode, "without artifacts/" in ran.stderr) == (2, True)
