"""The commands `backup` and `restore` against a farm that runs, and against what is no farm or no backup."""

from __future__ import annotations

import json
from pathlib import Path

from tests.integration.lippmann.conftest import Up, run


def test_a_farm_that_runs_is_backed_up_and_restored(farm: Up, tmp_path: Path) -> None:
    backup, data = str(tmp_path / "backup"), str(tmp_path / "data")
    made = run("backup", backup, "--data-dir", str(farm.data_dir), "--json")
    assert made.returncode == 0, made.stderr
    assert json.loads(made.stdout)["artifacts"]["count"] > 0
    assert run("backup", backup, "--data-dir", str(farm.data_dir)).returncode == 2
    restored = run("restore", backup, "--data-dir", data)
    assert restored.returncode == 0, restored.stderr
    assert restored.stdout.startswith(f"The backup is restored into {data}: ")
    again = run("restore", backup, "--data-dir", data)
    assert (again.returncode, "with artifacts, lippmann.db" in again.stderr) == (2, True)


def test_a_database_is_backed_up_and_restored_without_its_artifacts(farm: Up, tmp_path: Path) -> None:
    backup, data = str(tmp_path / "backup"), str(tmp_path / "data")
    made = run("backup", backup, "--no-artifacts", "--data-dir", str(farm.data_dir))
    assert made.returncode == 0, made.stderr
    assert not (tmp_path / "backup" / "artifacts").exists()
    refused = run("restore", backup, "--data-dir", data)
    assert (refused.returncode, "--no-artifacts" in refused.stderr) == (2, True)
    assert not (tmp_path / "data").exists()
    restored = run("restore", backup, "--no-artifacts", "--data-dir", data)
    assert restored.returncode == 0, restored.stderr


def test_what_is_no_farm_and_what_is_no_backup_is_refused(tmp_path: Path) -> None:
    refused = run("backup", str(tmp_path / "backup"), "--data-dir", str(tmp_path / "nothing"))
    assert (refused.returncode, refused.stdout) == (2, "")
    assert not (tmp_path / "nothing").exists()
    refused = run("restore", str(tmp_path), "--data-dir", str(tmp_path / "data"))
    assert (refused.returncode, "which has no manifest.json" in refused.stderr) == (2, True)


def test_a_database_that_does_not_answer_is_reported(tmp_path: Path) -> None:
    (tmp_path / "artifacts").mkdir()
    url = "postgresql+psycopg://nobody@127.0.0.1:1/x"
    ran = run("backup", str(tmp_path / "b"), "--data-dir", str(tmp_path), LIPPMANN_DATABASE_URL=url)
    assert (ran.returncode, ran.stderr.startswith("lippmann: the database does not answer")) == (1, True)


def test_a_farm_is_not_restored_under_one_that_runs(farm: Up, tmp_path: Path) -> None:
    backup = str(tmp_path / "backup")
    assert run("backup", backup, "--data-dir", str(farm.data_dir)).returncode == 0
    assert run("restore", backup, "--data-dir", str(farm.data_dir)).returncode == 2
