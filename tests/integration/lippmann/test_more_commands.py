"""Logs, priorities, removal and the state of a real farm, on several jobs at once."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from povtemplates.catalogue import scene_folders
from tests.integration.lippmann.conftest import Up, run
from tests.needs import needs_povray
from tests.waiting import until

pytestmark = needs_povray

SMALL = {
    "scene": "target-white", "frames": "1-2", "outputs": ["views.mp4", "view_grid.png"],
    "rig": {"px_per_lens": 2, "lens_array": {"count": [8, 8]}},
}  # fmt: skip


@pytest.fixture(scope="module")
def jobs(farm: Up) -> tuple[str, str]:
    """Two jobs, of which the first is watched to its end and the second waits behind a pause."""
    with farm.client() as client:
        paused = client.submit(SMALL | {"rig": {"px_per_lens": 64, "lens_array": {"count": [8, 8]}}, "frames": "1-50"})
        until(lambda: client.job(paused.id).status == "running")
        client.pause(paused.id)
    watched = _run(farm, "submit", "-", "--watch", given=json.dumps(SMALL))
    assert watched.returncode == 0, watched.stderr
    job = watched.stdout.split()[0]
    assert watched.stderr.splitlines()[-1] == f"`lippmann fetch {job}` brings its files to out/{job}/."
    return job, paused.id


def test_the_logs_of_a_job_hold_the_messages_of_povray(farm: Up, jobs: tuple[str, str]) -> None:
    said = _run(farm, "logs", jobs[0]).stdout
    assert said.count("==> render frame ") == 2
    assert said.startswith("==> probe, attempt 1, done (")
    assert "POV-Ray finished" in said
    followed = json.loads(_run(farm, "logs", jobs[0], "--follow", "--json").stdout)
    assert said.count("==> ") == len(followed)
    one = _run(farm, "logs", jobs[0], "--task", followed[0]["task"]).stdout
    assert said.startswith(one.rstrip("\n"))
    unknown = _run(farm, "logs", jobs[0], "--task", "nonsense")
    assert (unknown.returncode, "nonsense" in unknown.stderr) == (1, True)


def test_several_jobs_are_shown_and_a_refusal_keeps_nobody_from_the_others(farm: Up, jobs: tuple[str, str]) -> None:
    done, paused = jobs
    shown = json.loads(_run(farm, "show", done, paused, "--json").stdout)
    assert [job["status"] for job in shown] == ["done", "paused"]
    ended = _run(farm, "priority", done, paused, "80")
    assert ended.returncode == 1
    assert ended.stdout == f"{paused} paused, priority 80\n"
    assert ended.stderr.startswith(f"lippmann: {done}: ")


def test_the_state_of_the_farm_fits_some_lines(farm: Up, jobs: tuple[str, str]) -> None:
    ended = _run(farm, "status")
    assert ended.returncode == 0, ended.stdout
    lines = {line.split()[0]: line for line in ended.stdout.splitlines()}
    assert farm.address.url in lines["farm"]
    assert "1 paused" in lines["jobs"]
    data = json.loads(_run(farm, "status", "--json").stdout)
    assert (data["health"]["status"], data["jobs"]["paused"], len(data["workers"])) == ("ok", 1, 1)
    assert data["workers"][0]["seen_at"].endswith("Z")


def test_a_fetch_goes_to_a_folder_of_its_job_and_takes_the_outputs_that_are_named(
    farm: Up, jobs: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done, paused = jobs
    monkeypatch.chdir(tmp_path)
    assert _run(farm, "fetch", done, "--outputs", "views.mp4").returncode == 0
    brought = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.*") if not path.name.startswith(".")}
    assert brought == {f"out/{done}/video/views.mp4", f"out/{done}/video/views.mp4.json"}
    mixed = _run(farm, "fetch", paused, "--out", f"out/{done}")
    assert (mixed.returncode, f"the files of job {done}" in mixed.stderr) == (2, True)
    beyond = _run(farm, "fetch", done, "--frames", "1-9")
    assert beyond.returncode == 2
    assert beyond.stderr.endswith("--frames: expected frames of the job, which are 1-2, got 3-9\n")


def test_scenes_and_ended_jobs_are_removed(farm: Up, jobs: tuple[str, str], tmp_path: Path) -> None:
    manifest = (scene_folders()["target-white"] / "scene.toml").read_text().partition("[parameters")[0]
    (tmp_path / "gone").mkdir()
    (tmp_path / "gone" / "scene.inc").write_text("background { rgb 1 }")
    (tmp_path / "gone" / "scene.toml").write_text(manifest)
    assert _run(farm, "scenes", "upload", str(tmp_path / "gone")).returncode == 0
    assert _run(farm, "scenes", "rm", "gone").stdout == "The scene gone is removed.\n"
    meant = _run(farm, "scenes", "rm", "fsh")
    assert (meant.returncode, "there is no scene 'fsh' (did you mean fish?)" in meant.stderr) == (1, True)
    job = jobs[1]
    assert _run(farm, "rm", job).returncode == 1  # It has not ended.
    assert _run(farm, "cancel", job).returncode == 0
    assert _run(farm, "rm", job).stdout == f"{job} removed\n"
    assert _run(farm, "show", job).returncode == 1


def _run(farm: Up, *arguments: str, given: str = "") -> subprocess.CompletedProcess[str]:
    return run(*arguments, given=given, LIPPMANN_DATA_DIR=str(farm.data_dir))
