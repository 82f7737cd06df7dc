"""Every command against a real farm."""

from __future__ import annotations

import json
import signal
import subprocess
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest

from povtemplates.catalogue import scene_folders
from tests.integration.lippmann.conftest import LIPPMANN, Up, run
from tests.needs import needs_povray
from tests.waiting import ENOUGH_S, until

pytestmark = needs_povray

SMALL = {"scene": "target-white", "frames": "1-2", "rig": {"px_per_lens": 2, "lens_array": {"count": [8, 8]}}}


@pytest.fixture(scope="module")
def done_job(farm: Up) -> dict[str, Any]:
    """A small job that was submitted and watched by the command."""
    outputs = 'outputs=["views.mp4", "view_grid.png"]'
    ended = _run(farm, "submit", "-", "--set", outputs, "--watch", "--json", given=json.dumps(SMALL))
    assert ended.returncode == 0, ended.stderr
    job: dict[str, Any] = json.loads(ended.stdout)
    assert f"{job['id']}: 100% done, 2 of 2 frames" in ended.stderr
    return job


def test_submit_and_watch_end_when_the_job_is_done(done_job: dict[str, Any]) -> None:
    assert (done_job["status"], done_job["frames_done"], done_job["spec"]["rig"]["px_per_lens"]) == ("done", 2, 2)


def test_watch_of_a_job_that_is_done_ends_at_once(farm: Up, done_job: dict[str, Any]) -> None:
    ended = _run(farm, "watch", done_job["id"])
    assert (ended.returncode, ended.stdout) == (0, f"{done_job['id']} done\n")
    assert [line for line in ended.stderr.splitlines() if line.startswith("note: ")] == [
        f"note: {note}" for note in done_job["notes"]
    ]
    assert done_job["notes"]


def test_fetch_brings_everything_once_and_what_was_lost_again(
    farm: Up, done_job: dict[str, Any], tmp_path: Path
) -> None:
    out = str(tmp_path / "out")
    first = json.loads(_run(farm, "fetch", done_job["id"], "--out", out, "--json").stdout)
    names = [str(Path(name).relative_to(out)) for name in first["files"]]
    assert names == [f"{kind}/000{frame}.png" for kind in ("integral", "orthoscopic", "views") for frame in (1, 2)] + [
        "video/views.mp4",
        "video/views.mp4.json",
        "exports/view_grid.png.json",
        "exports/view_grid/0001.png",
        "exports/view_grid/0002.png",
    ]
    assert first["brought"] == 11
    assert all(Path(name).stat().st_size for name in first["files"])
    assert json.loads(_run(farm, "fetch", done_job["id"], "--out", out, "--json").stdout)["brought"] == 0
    Path(out, names[0]).write_bytes(b"half")
    Path(out, names[6]).unlink()
    again = json.loads(_run(farm, "fetch", done_job["id"], "--out", out, "--json").stdout)
    assert (again["brought"], again["files"]) == (2, first["files"])
    assert not list(Path(out).rglob("*.part"))


def test_fetch_brings_masters_and_single_frames_when_asked(farm: Up, done_job: dict[str, Any], tmp_path: Path) -> None:
    ended = _run(farm, "fetch", done_job["id"], "--out", str(tmp_path), "--masters", "--frames", "2")
    assert ended.returncode == 0
    assert {path.name for path in tmp_path.rglob("*.exr")} == {"0002.exr"}
    assert (tmp_path / "integral" / "0002.exr").read_bytes()[:4] == b"\x76\x2f\x31\x01"  # OpenEXR's magic number


def test_a_link_downloads_a_file_without_a_key(farm: Up, done_job: dict[str, Any]) -> None:
    ended = _run(farm, "link", done_job["id"], "video/views.mp4", "--hours", "1")
    assert ended.returncode == 0, ended.stderr
    with urlopen(ended.stdout.strip(), timeout=ENOUGH_S) as answer:
        assert answer.read()[4:8] == b"ftyp"
    assert "link-artifact" in _run(farm, "keys", "audit").stdout
    beyond = _run(farm, "link", done_job["id"], "video/views.mp4", "--hours", "1000")
    assert (beyond.returncode, "expires_in_s" in beyond.stderr) == (2, True)


def test_what_a_frame_of_a_job_shows_is_what_its_master_shows(
    farm: Up, done_job: dict[str, Any], tmp_path: Path
) -> None:
    _run(farm, "fetch", done_job["id"], "--out", str(tmp_path), "--masters")
    for words in (["view", "--u", "0", "--v", "1"], ["refocus", "--depth-mm", "2"], ["observe", "--eye", "0,0,500"]):
        command, *options = words
        pictures = []
        for place, source in enumerate(([done_job["id"]], [str(tmp_path)])):
            out = tmp_path / f"{command}-{place}.png"
            ended = _run(farm, command, *source, "--frame", "2", *options, "--out", str(out))
            assert ended.returncode == 0, ended.stderr
            pictures.append(out.read_bytes())
        assert pictures[0] == pictures[1]
    ended = _run(farm, "view", done_job["id"], "--frame", "7", "--centre", "--out", str(tmp_path / "no.png"))
    assert (ended.returncode, ", 1-2, got 7" in ended.stderr) == (2, True)


def test_jobs_and_show_say_the_same_as_text_and_as_json(farm: Up, done_job: dict[str, Any]) -> None:
    jobs = json.loads(_run(farm, "jobs", "--json").stdout)
    assert done_job["id"] in [job["id"] for job in jobs]
    assert f"{done_job['id']}  done" in _run(farm, "jobs", "--status", "done").stdout
    assert json.loads(_run(farm, "show", done_job["id"], "--json").stdout)["id"] == done_job["id"]
    shown = _run(farm, "show", done_job["id"]).stdout
    assert "8 x 8 lenses, 16 x 16 px" in shown
    assert "2 of 2 (1-2)" in shown


def test_a_job_moves_and_a_move_that_cannot_be_names_both_statuses(farm: Up) -> None:
    long = SMALL | {"rig": {"px_per_lens": 64}, "frames": "1-50"}
    job = json.loads(_run(farm, "submit", "-", "--json", given=json.dumps(long)).stdout)["id"]
    until(lambda: json.loads(_run(farm, "show", job, "--json").stdout)["status"] == "running")
    assert _run(farm, "pause", job).stdout == f"{job} paused\n"
    refused = _run(farm, "pause", job)
    assert refused.returncode == 1
    assert "paused" in refused.stderr
    assert _run(farm, "resume", job).stdout == f"{job} running\n"
    assert _run(farm, "cancel", job).stdout == f"{job} cancelled\n"
    watched = _run(farm, "watch", job)
    assert watched.returncode == 1
    assert f"job {job} cancelled" in watched.stderr
    assert _run(farm, "retry", job).stdout == f"{job} running\n"
    assert json.loads(_run(farm, "cancel", job, "--json").stdout)["status"] == "cancelled"


def test_a_job_of_a_broken_scene_fails_with_povrays_message(farm: Up, tmp_path: Path) -> None:
    own = _scene(tmp_path / "broken", "sphere { nonsense }")
    uploaded = json.loads(_run(farm, "scenes", "upload", str(own), "--json").stdout)
    assert (uploaded["name"], uploaded["builtin"]) == ("broken", False)
    ended = _run(farm, "submit", "-", "--watch", given=json.dumps(SMALL | {"scene": "broken"}))
    assert ended.returncode == 1
    assert "nonsense" in ended.stderr


def test_scenes_are_listed_and_shown_with_their_parameters(farm: Up) -> None:
    assert "fish" in [scene["name"] for scene in json.loads(_run(farm, "scenes", "list", "--json").stdout)]
    assert "turn_deg_per_frame  number  8.0" in _run(farm, "scenes", "show", "fish").stdout
    assert "fish" in _run(farm, "scenes", "list").stdout


def test_a_bundle_that_is_not_whole_is_refused_before_it_travels(farm: Up, tmp_path: Path) -> None:
    (tmp_path / "half").mkdir()
    (tmp_path / "half" / "scene.inc").write_text("")
    ended = _run(farm, "scenes", "upload", str(tmp_path / "half"))
    assert ended.returncode == 2
    assert "scene.toml" in ended.stderr


def test_keys_are_made_listed_and_revoked_and_hold_to_their_role(farm: Up) -> None:
    made = json.loads(_run(farm, "keys", "create", "eve", "--role", "viewer", "--json").stdout)
    url = farm.said["url"]
    assert run("jobs", LIPPMANN_URL=url, LIPPMANN_KEY=made["key"]).returncode == 0
    refused = run("submit", "-", given=json.dumps(SMALL), LIPPMANN_URL=url, LIPPMANN_KEY=made["key"])
    assert refused.returncode == 4
    assert "submitter" in refused.stderr
    assert made["key"] not in _run(farm, "keys", "list").stdout
    assert json.loads(_run(farm, "keys", "revoke", made["id"], "--json").stdout) == {"id": made["id"], "revoked": True}
    assert run("jobs", LIPPMANN_URL=url, LIPPMANN_KEY=made["key"]).returncode == 4
    assert "/login?token=" in _run(farm, "keys", "link").stdout


def test_fields_that_are_wrong_are_named_with_and_without_the_service(farm: Up) -> None:
    here = _run(farm, "submit", "-", "--set", "rig.px_per_lens=1", given=json.dumps(SMALL))
    there = _run(farm, "submit", "-", "--set", "parameters.nonsense=1", given=json.dumps(SMALL))
    assert (here.returncode, there.returncode) == (2, 2)
    assert "rig.px_per_lens: expected a number of at least 2, got 1" in here.stderr
    assert "parameters.nonsense: expected" in there.stderr


def test_ctrl_c_ends_watch_with_130_and_leaves_the_job_alone(farm: Up) -> None:
    long = SMALL | {"rig": {"px_per_lens": 64}, "frames": "1-50"}
    with farm.client() as client:
        job = client.submit(long)
        watching = subprocess.Popen(
            [*LIPPMANN, "watch", job.id, "--data-dir", str(farm.data_dir)], stderr=subprocess.PIPE, text=True
        )
        assert watching.stderr is not None
        assert watching.stderr.readline()
        watching.send_signal(signal.SIGINT)
        assert watching.wait(ENOUGH_S) == 130
        assert f"The job goes on. `lippmann watch {job.id}` comes back to it" in watching.stderr.read()
        watching.stderr.close()
        assert client.job(job.id).status in ("queued", "probing", "running")
        client.cancel(job.id)


def test_capture_renders_one_frame_of_a_folder_without_a_farm(tmp_path: Path) -> None:
    own = _scene(tmp_path / "mine", "background { rgb <0, 0.5, 1> }")
    out = tmp_path / "out"
    ended = run("capture", str(own), "--frame", "3", "--out", str(out), "--json", "--set", "rig.px_per_lens=2",
                "--set", "rig.lens_array.count=[6, 6]", LIPPMANN_SLOTS="1")  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    said = json.loads(ended.stdout)
    made = {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()}
    assert made == {f"{kind}/0003.{form}" for kind in ("integral", "orthoscopic", "views") for form in ("png", "exr")}
    assert {str(Path(name).relative_to(out)) for name in said["files"]} == made


def test_capture_of_a_broken_scene_fails_with_povrays_message_and_leaves_nothing(tmp_path: Path) -> None:
    own = _scene(tmp_path / "broken", "sphere { nonsense }")
    ended = run("capture", str(own), "--out", str(tmp_path / "out"))
    assert ended.returncode == 1
    assert "nonsense" in ended.stderr
    assert "Traceback" not in ended.stderr
    assert not list((tmp_path / "out").iterdir())


ENDLESS = "#declare A = 0; #while (A < 1) #declare B = A; #end"
"""A scene that parses without end, while POV-Ray reports more and more tokens."""


@pytest.mark.parametrize("field", ["parse_timeout_s", "probe_timeout_s"])
def test_capture_of_an_endless_scene_ends_at_its_limit_and_names_it(tmp_path: Path, field: str) -> None:
    own = _scene(tmp_path / "endless", ENDLESS)
    ended = run("capture", str(own), "--out", str(tmp_path / "out"), "--set", f"render.{field}=2")
    assert ended.returncode == 1
    assert f"2 s, the limit that render.{field} of the job gives" in ended.stderr


def test_a_worker_lowers_the_limits_of_a_job(tmp_path: Path) -> None:
    own = _scene(tmp_path / "endless", ENDLESS)
    ended = run("capture", str(own), "--out", str(tmp_path / "out"), LIPPMANN_PARSE_TIMEOUT_S="2")
    assert ended.returncode == 1
    assert "2 s, the limit that LIPPMANN_PARSE_TIMEOUT_S of the worker gives" in ended.stderr


def test_endless_jobs_on_every_slot_fail_at_their_limit_and_leave_the_farm_to_others(farm: Up, tmp_path: Path) -> None:
    own = _scene(tmp_path / "endless", ENDLESS)
    assert _run(farm, "scenes", "upload", str(own)).returncode == 0
    endless = json.dumps(SMALL | {"scene": "endless", "render": {"parse_timeout_s": 2}})
    jobs = [json.loads(_run(farm, "submit", "-", "--json", given=endless).stdout)["id"] for _ in range(2)]
    other = _run(farm, "submit", "-", "--watch", "--json", given=json.dumps(SMALL | {"outputs": []}))
    assert json.loads(other.stdout)["status"] == "done"
    with farm.client() as client:
        until(lambda: all(client.job(job).status == "failed" for job in jobs))
        for job in map(client.job, jobs):
            assert job.error is not None
            assert job.error.code == "parse-timeout"
            assert "2 s, the limit that render.parse_timeout_s of the job gives" in job.error.message
            assert [task.attempt_number for task in client.tasks(job.id)] == [2]


def test_the_demo_makes_a_frame_of_the_paper_and_says_where_to_look(tmp_path: Path) -> None:
    ended = run("demo", "--frames", "1", "--data-dir", str(tmp_path / "data"), "--out", str(tmp_path / "out"))
    assert ended.returncode == 0, ended.stderr
    assert "frames 1 of 720 x 720 px, 90 x 90 lenses" in ended.stderr
    assert "Where to look:" in ended.stdout
    for name in ("integral/0001.png", "orthoscopic/0001.png", "views/0001.png", "video/centre.mp4", "video/views.mp4"):
        assert (tmp_path / "out" / name).stat().st_size > 1000
    assert not (tmp_path / "data" / "farm.json").exists()


def _run(farm: Up, *arguments: str, given: str = "") -> subprocess.CompletedProcess[str]:
    return run(*arguments, given=given, LIPPMANN_DATA_DIR=str(farm.data_dir))


def _scene(folder: Path, scene: str) -> Path:
    folder.mkdir()
    (folder / "scene.inc").write_text(scene)
    manifest = (scene_folders()["target-white"] / "scene.toml").read_text().partition("[parameters")[0]
    (folder / "scene.toml").write_text(manifest)
    return folder
