"""What `lippmann fetch` brings of jobs that have not made everything, and what it says of the rest."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import av
import pytest

from lippmann.client.fetch import fetch_job
from lippmann.client.missing import MISSING, Why
from lippmann.job.states import JobStatus
from tests.failing_scene import scene_without_frame
from tests.farm import ended
from tests.integration.lippmann.conftest import Up, run
from tests.needs import needs_povray

pytestmark = needs_povray

SMALL = {"rig": {"px_per_lens": 2, "lens_array": {"count": [8, 8]}}, "outputs": ["views.mp4"]}


def fetched(farm: Up, job_id: str, out: Path) -> subprocess.CompletedProcess[str]:
    return run("fetch", job_id, "--out", str(out), "--json", "--data-dir", str(farm.data_dir))


def listed(out: Path) -> dict[str, Any]:
    missing: dict[str, Any] = json.loads((out / MISSING).read_text())
    return missing


def test_a_failed_job_gives_what_it_made_and_names_the_frame_that_failed(farm: Up, tmp_path: Path) -> None:
    # Frames 1, 4 and 6 are rendered first, so that something is made before the job ends.
    with farm.client() as client:
        client.upload_scene("fails-at-5", scene_without_frame(5, tmp_path / "scene"))
        job = ended(client, client.submit(SMALL | {"scene": "fails-at-5", "frames": "1-6"}).id)
        made = {frame.frame for frame in client.frames(job.id) if frame.status == "done"}
    assert (job.status, made >= {1}) == (JobStatus.FAILED, True)
    done = fetched(farm, job.id, tmp_path / "out")
    assert done.returncode == 5
    # An assembly that was stopped when the job ended may have stored some or all of its files.
    brought = {int(path.stem) for path in tmp_path.glob("out/integral/*.png")}
    assert brought >= made
    missing = listed(tmp_path / "out")
    assert json.loads(done.stdout)["missing"] == missing
    assert (missing["job"], missing["status"]) == (job.id, "failed")
    numbers = {frame["frame"] for frame in missing["frames"]}
    assert numbers.isdisjoint(made)
    assert numbers | brought == set(range(1, 7))
    (failed,) = [frame for frame in missing["frames"] if frame["why"] == "failed"]
    assert failed["frame"] == 5
    assert "the ball cannot be at 5" in failed["error"]
    assert failed["files"] == [f"{kind}/0005.exr" for kind in ("integral", "orthoscopic", "views")]
    assert [(each["output"], each["why"]) for each in missing["outputs"]] == [("views.mp4", "not-begun")]
    assert "(1 not begun) of job" in done.stderr
    assert "the first error" in done.stderr
    assert "the ball cannot be at 5" in done.stderr
    only = run("fetch", job.id, "--out", str(tmp_path / "only"), "--frames", "5", "--data-dir", str(farm.data_dir))
    assert [frame["frame"] for frame in listed(tmp_path / "only")["frames"]] == [5]
    assert only.returncode == 5


def test_a_job_that_runs_or_was_cancelled_gives_what_there_is(farm: Up, tmp_path: Path) -> None:
    with farm.client() as client:
        job = client.submit(SMALL | {"scene": "target-white", "frames": "1-40"})
        early = fetch_job(client, job.id, tmp_path)
        assert {frame.why for frame in early.missing.frames} <= {Why.RUNNING, Why.NOT_BEGUN}
        assert {frame.frame for frame in early.missing.frames} >= set(range(20, 41))
        assert [(each.output, each.why) for each in early.missing.outputs] == [("views.mp4", Why.NOT_BEGUN)]
        client.cancel(job.id)
        late = fetch_job(client, job.id, tmp_path)
    assert {frame.why for frame in late.missing.frames} == {Why.CANCELLED}
    assert late.missing.outputs[0].why is Why.CANCELLED
    assert listed(tmp_path)["status"] == "cancelled"


@pytest.mark.parametrize("name", ["integral/0001.exr", "video/views.mp4"])
def test_a_file_that_is_gone_from_the_store_is_named_until_the_job_is_repaired(
    farm: Up, tmp_path: Path, name: str
) -> None:
    with farm.client() as client:
        job = ended(client, client.submit(SMALL | {"scene": "target-white", "frames": "1-2"}).id)
        assert fetched(farm, job.id, tmp_path).returncode == 0
        assert not (tmp_path / MISSING).exists()
        (farm.data_dir / "artifacts" / job.id / name).unlink()
        done = fetched(farm, job.id, tmp_path)
        assert (done.returncode, json.loads(done.stdout)["brought"]) == (5, 0)
        missing = listed(tmp_path)
        (found,) = missing["frames"] + missing["outputs"]
        assert (found["why"], found["files"]) == ("damaged", [name])
        client.repair(job.id)
        assert ended(client, job.id).status is JobStatus.DONE
    assert fetched(farm, job.id, tmp_path).returncode == 0
    assert not (tmp_path / MISSING).exists()


def test_a_job_is_done_without_the_frame_that_fails_for_ever(farm: Up, tmp_path: Path) -> None:
    """Two tiles a frame, an assembly between them and the outputs, and a video that is one frame shorter."""
    spec = SMALL | {"scene": "fails-at-2", "frames": "1-4", "render": {"tiles": [2, 1]}}
    with farm.client() as client:
        client.upload_scene("fails-at-2", scene_without_frame(2, tmp_path / "scene"))
        job = ended(client, client.submit(spec | {"outputs": ["centre.mkv", "view_grid.png"]}).id)
        assert job.status is JobStatus.FAILED
        skipped = run("skip", job.id, "--data-dir", str(farm.data_dir))
        assert (skipped.returncode, skipped.stdout) == (0, f"{job.id} running\n"), skipped.stderr
        job = ended(client, job.id)
        assert (job.status, job.skipped_frames, job.frames_done) == (JobStatus.DONE, (2,), 3)
        shown = run("show", job.id, "--data-dir", str(farm.data_dir)).stdout
        assert "frames 2" in shown
        assert fetched(farm, job.id, tmp_path / "out").returncode == 5
        assert [(each["frame"], each["why"]) for each in listed(tmp_path / "out")["frames"]] == [(2, "skipped")]
        assert listed(tmp_path / "out")["outputs"] == []
        with av.open(str(tmp_path / "out" / "video" / "centre.mkv")) as video:
            assert sum(1 for _ in video.decode(video=0)) == 3
        assert sorted(path.name for path in tmp_path.glob("out/exports/view_grid/*.png")) == [
            "0001.png", "0003.png", "0004.png",
        ]  # fmt: skip
        client.retry(job.id)
        again = ended(client, job.id)
    assert (again.status, again.skipped_frames, again.frames_done) == (JobStatus.FAILED, (), 3)
    assert "the ball cannot be at 2" in (again.error.message if again.error else "")
