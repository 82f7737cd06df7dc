"""The one-machine farm: it comes up, goes on, and leaves nothing behind."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import socket
import subprocess
from functools import partial
from pathlib import Path

import httpx
import pytest

from lippmann.farm.supervisor.broker import socket_path
from lippmann.farm.supervisor.descendants import descendants
from tests.farm import wait_for_slots
from tests.integration.lippmann.conftest import LIPPMANN, Up, alive, born, lippmann_up, run
from tests.needs import needs_povray
from tests.waiting import ENOUGH_S, halt, until

pytestmark = needs_povray

LONG_JOB = {"scene": "fish", "rig": {"px_per_lens": 32}, "render": {"tiles": [2, 1]}}
"""Minutes of work: two tiles, so that both slots render."""


def test_it_answers_says_where_it_is_and_leaves_nothing_after_ctrl_c(tmp_path: Path) -> None:
    data_dir = tmp_path / ("long" * 40)  # longer than the path of a Unix socket may be
    socket_in_tmp = socket_path(data_dir / "broker")
    with lippmann_up(data_dir) as up:
        assert socket_in_tmp.is_relative_to("/tmp")
        assert socket_in_tmp.exists()
        assert up.said.keys() == {"url", "login_url", "data_dir", "pid"}
        assert httpx.get(f"{up.said['url']}/api/v1/health").json()["database"]["ok"]
        with up.client() as client:
            wait_for_slots(client, 2)
        login = httpx.get(up.said["login_url"])
        assert (login.status_code, "lippmann_session" in login.cookies) == (303, True)
        processes = set(up.below())
        assert len(processes) >= 6  # supervisor, broker, service, worker and its two slots
        assert up.end() == 0
        assert not alive(processes)
    assert not (data_dir / "farm.json").exists()
    assert not list(data_dir.rglob("*.sock"))
    assert not socket_in_tmp.parent.exists()
    assert {path.name for path in (data_dir / "log").iterdir()} == {"broker.log", "service.log", "worker.log"}


@pytest.mark.parametrize("victims", [["up"], ["supervisor"], ["up", "supervisor"]], ids=" and ".join)
def test_kill_9_in_the_middle_of_a_rendering_leaves_nothing(tmp_path: Path, victims: list[str]) -> None:
    with lippmann_up(tmp_path) as up:
        _render(up)
        processes = set(up.below())
        pids = {"up": up.process.pid, "supervisor": up.one("lippmann.farm.supervisor")}
        for victim in victims:  # whoever looks after the other goes first
            os.kill(pids[victim], signal.SIGKILL)
        until(lambda: not alive(processes))
        assert up.process.wait(ENOUGH_S) == (-signal.SIGKILL if "up" in victims else 1)
    with lippmann_up(tmp_path) as up, up.client() as client:  # and the next start goes on
        assert [job.status for job in client.jobs()] == ["running"]


def test_ctrl_c_in_the_middle_of_a_rendering_is_told_and_leaves_nothing(tmp_path: Path) -> None:
    with lippmann_up(tmp_path) as up:
        _render(up)
        processes = set(up.below())
        assert up.end() == 0
        assert not alive(processes)
    assert (tmp_path / "log" / "worker.log").read_text().count("code=stopped") == 2, "both attempts had their last word"
    with lippmann_up(tmp_path) as up, up.client() as client:
        (job,) = client.jobs()
        assert job.status == "running"
        assert not [task for task in client.tasks(job.id) if task.failures], "to be stopped is no failure"


def test_signals_that_are_ignored_from_the_start_stay_ignored_and_sigterm_ends_it(tmp_path: Path) -> None:
    with lippmann_up(tmp_path, through=["sh", "-c", 'trap "" INT HUP; exec "$@"', "sh"]) as up:
        ignored = _signals(up.process.pid, "SigIgn")
        assert {signal.SIGINT, signal.SIGHUP} <= ignored
        assert signal.SIGTERM not in ignored
        assert up.end(signal.SIGTERM) == 0


def test_a_second_ctrl_c_ends_everything_at_once(tmp_path: Path) -> None:
    told = tmp_path / "told"
    with lippmann_up(tmp_path, through=["sh", "-c", 'exec "$@" 2>"$0"', str(told)]) as up:
        with up.client() as client:
            wait_for_slots(client, 2)
        processes = set(up.below())
        worker = up.one("lippmann.cli.main worker")
        halt(worker)  # it will not hear that it should end
        up.process.send_signal(signal.SIGINT)
        until(lambda: signal.SIGTERM in _signals(worker, "ShdPnd"))
        up.process.send_signal(signal.SIGINT)
        assert up.process.wait(ENOUGH_S) == 0
        assert not alive(processes)
    assert "service is asked to end" not in told.read_text(), "nothing waits for the worker"


def test_what_dies_is_started_again_at_the_same_address_with_the_same_key(tmp_path: Path) -> None:
    with lippmann_up(tmp_path) as up, up.client(patience_s=30) as client:
        wait_for_slots(client, 2)
        for words in ("lippmann.cli.main serve", "valkey-server", "lippmann.cli.main worker"):
            old = up.one(words)
            os.kill(old, signal.SIGKILL)
            until(partial(_is_another, up, words, old))
        job = client.submit({"scene": "target-white", "rig": {"lens_array": {"count": [4, 4]}}, "outputs": []})
        until(lambda: client.job(job.id).status == "done")
        workers = [line for line in up.below().values() if "lippmann.cli.main worker" in line]
        assert len(workers) == 5, "one parent and two processes of each of two slots; nothing of the old ones"


def test_the_next_start_has_the_jobs_and_keys_of_the_last(tmp_path: Path) -> None:
    with lippmann_up(tmp_path) as up, up.client() as client:
        job = client.submit({"scene": "target-white"})
        client.pause(job.id) if client.job(job.id).status == "running" else client.cancel(job.id)
        key = client.create_key("alice", "viewer", owner_id="alice", expires_in_days=1, limits={"open_jobs": 3})
    with lippmann_up(tmp_path) as up, up.client() as client:
        assert [found.id for found in client.jobs()] == [job.id]
        keys = client.keys()
        assert [(found.name, found.owner_id, found.limits.open_jobs) for found in keys] == [
            ("admin", "admin", None),
            ("alice", "alice", 3),
        ]
        assert keys[1].expires_at == key.expires_at
        (created,) = (entry for entry in client.audit() if entry.action == "create-key")
        assert (created.name, created.role, created.subject, created.address) == (
            "admin", "admin", key.id, "127.0.0.1",
        )  # fmt: skip
        assert run("jobs", "--url", up.said["url"], "--key", key.key).returncode == 0


@pytest.mark.promise("Between processes", "No other user of the machine lists or reads the files of a farm.")
@pytest.mark.parametrize(
    "name", ["dätä 日", os.fsdecode(b"caf\xe9"), "a?b#c%41"], ids=["UTF-8", "ISO 8859-1", "characters of URLs"]
)
def test_a_data_folder_may_have_any_name_and_is_closed_to_other_users(tmp_path: Path, name: str) -> None:
    small = {"px_per_lens": 2, "lens_array": {"count": [4, 4]}}
    with lippmann_up(tmp_path / name) as up, up.client() as client:
        assert up.said["data_dir"] == str(tmp_path / name)
        job = client.submit({"scene": "target-white", "rig": small, "outputs": ["views.mp4"]})
        until(lambda: client.job(job.id).status in ("done", "failed"))
        assert client.job(job.id).error is None
        fetched = run(
            "fetch", job.id, "--json", "--out", str(tmp_path / name / "out"), "--data-dir", str(tmp_path / name)
        )
        assert fetched.returncode == 0, fetched.stderr
    assert (tmp_path / name / "out" / "video" / "views.mp4").stat().st_size > 0
    assert [path.name for path in tmp_path.iterdir()] == [name], "nothing is beside the folder"
    shutil.rmtree(tmp_path / name / "out")  # which a user made, and no farm
    _check_closed(tmp_path / name)


def _check_closed(data_dir: Path) -> None:
    """Check the mode of every file: root's sandboxes have users of their own, who pass through four folders."""
    is_root = os.geteuid() == 0
    passed = {data_dir / "scratch" / name for name in ("", "attempts", "bundles")} | {data_dir} if is_root else set()
    files = {data_dir, *data_dir.rglob("*")}
    assert len(files) > 30, "a job left its files here"
    for path in files:
        mode = path.lstat().st_mode & 0o777
        if is_root and (data_dir / "scratch" / "bundles") in path.parents:
            continue  # its name is a SHA-256, and nobody lists the folder
        expected = 0o711 if path in passed else 0o700 if path.is_dir() else 0o600
        assert mode == expected, f"{path}: {mode:o}"


def test_a_second_farm_on_the_same_folder_is_refused_and_the_first_does_not_notice(farm: Up) -> None:
    second = run("up", "--port", "0", "--data-dir", str(farm.data_dir))
    assert second.returncode == 2
    assert re.search(r"expected a data folder that no farm uses, got .*, where one runs \(process \d+\)", second.stderr)
    with farm.client() as client:
        assert client.health().database.ok


def test_a_port_that_is_taken_is_refused_before_anything_starts(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        for arguments in (("up",), ("serve",), ("demo", "--out", str(tmp_path / "out"))):
            ended = run(*arguments, "--port", port, "--data-dir", str(tmp_path / "data"))
            assert ended.returncode == 2
            assert f"expected a free port, got 127.0.0.1:{port}" in ended.stderr
    assert not (tmp_path / "data" / "lippmann.db").exists()


def test_a_read_only_data_folder_is_refused_by_name(bwrap: list[str], tmp_path: Path) -> None:
    folder = tmp_path / "data"
    folder.mkdir()
    # Mounted read-only: taking the right to write away does not stop root.
    inside = [*bwrap, "--ro-bind", str(folder), str(folder), "--", *LIPPMANN]
    for name, written in {"up": folder, "serve": folder, "worker": folder / "scratch"}.items():
        command = [*inside, name, "--data-dir", str(folder)]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=ENOUGH_S)
        assert ended.returncode == 2, ended.stderr
        assert re.search(f"folder that can be written, got {written}: Read-only file system", ended.stderr)


def test_a_disk_that_is_full_is_refused_with_numbers(bwrap: list[str], tmp_path: Path) -> None:
    small = [*bwrap, "--size", "5000000", "--tmpfs", str(tmp_path), "--", *LIPPMANN]
    ended = subprocess.run(
        [*small, "up", "--data-dir", str(tmp_path)], capture_output=True, text=True, timeout=ENOUGH_S
    )
    assert ended.returncode == 2
    assert re.search(rf"expected at least 100 MB free in {tmp_path}, got [45] MB", ended.stderr)


def test_ctrl_c_ends_a_demo_with_130_and_leaves_nothing(tmp_path: Path) -> None:
    arguments = ["demo", "--data-dir", str(tmp_path / "data"), "--out", str(tmp_path / "out")]
    with subprocess.Popen([*LIPPMANN, *arguments], stderr=subprocess.PIPE, text=True) as demo:
        assert demo.stderr is not None
        assert any("0 of 6 frames" in line for line in demo.stderr)
        processes = {found for pid in descendants(demo.pid) if (found := born(pid))}
        demo.send_signal(signal.SIGINT)
        assert demo.wait(ENOUGH_S) == 130
    assert len(processes) >= 4
    assert not alive(processes)
    assert not list((tmp_path / "out").iterdir())


def test_the_service_alone_says_where_it_is_keeps_its_key_and_ends_when_told(tmp_path: Path) -> None:
    key_file = tmp_path / "keys" / "admin.key"
    arguments = ["serve", "--json", "--port", "0", "--data-dir", str(tmp_path), "--key-file", str(key_file)]
    keys = set()
    for _ in range(2):
        with subprocess.Popen(
            [*LIPPMANN, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as service:
            assert service.stdout is not None
            assert service.stderr is not None
            url = json.loads(service.stdout.readline())["url"]
            assert any(f"The service listens on {url}" in line for line in service.stderr)
            headers = {"Authorization": f"Bearer {key_file.read_text().strip()}"}
            assert httpx.get(f"{url}/api/v1/jobs", headers=headers).status_code == 200
            keys.add(key_file.read_text())
            service.send_signal(signal.SIGTERM)
            assert service.wait(ENOUGH_S) == 0
    assert len(keys) == 1


def _render(up: Up) -> None:
    """Bring POV-Ray to work in the farm."""
    with up.client() as client:
        client.submit(LONG_JOB)
    until(lambda: sum(line.split(" ")[0].endswith("/povray") for line in up.below().values()) >= 2)


def _is_another(up: Up, words: str, old: int) -> bool:
    """Return whether the farm has a process of these words that is not the old one."""
    return any(words in line and pid != old for (pid, _), line in up.below().items())


def _signals(pid: int, mask: str) -> set[int]:
    """Return the signals in one of the masks of a process: `ShdPnd` waits for it, `SigIgn` is ignored by it."""
    (line,) = [line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith(f"{mask}:")]
    bits = int(line.split()[1], 16)
    return {number for number in signal.valid_signals() if bits >> (number - 1) & 1}
