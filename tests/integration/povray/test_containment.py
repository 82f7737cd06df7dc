"""What a scene must not do, tried for real in each sandbox."""

from __future__ import annotations

import os
import socket
import subprocess
from pathlib import Path

import pytest

from lippmann.errors import SandboxMissing, SceneError
from tests.integration.povray.conftest import BALL, Room
from tests.waiting import ENOUGH_S
from worker.engines.povray.environment import prepare
from worker.sandbox.detect import detect, trial
from worker.sandbox.limits import Limits
from worker.sandbox.sandbox import Sandbox

LIMITS = Limits(cpu_s=20, memory_mb=1024, file_mb=8)


def _inside(room: Room, *argv: str) -> subprocess.CompletedProcess[str]:
    """Run another program where POV-Ray would run."""
    line = room.sandbox.wrap(list(argv), readable=[room.bundle], writable=room.task_dir, limits=LIMITS)
    env = prepare(room.bundle, room.task_dir)
    return subprocess.run(line, cwd=room.task_dir, env=env, capture_output=True, text=True, timeout=ENOUGH_S)


@pytest.mark.promise("Scenes", "A scene reads no file of the machine.")
@pytest.mark.parametrize("way", ['#include "/etc/passwd"', '#fopen F "/etc/passwd" read #read (F, A)'])
def test_a_scene_cannot_read_the_machines_files(held: Room, way: str) -> None:
    with pytest.raises(SceneError, match="no file '/etc/passwd' in the scene bundle"):
        held.render(f"{way}\n{BALL}")
    assert "root:" not in held.log.read_text()


@pytest.mark.promise("Scenes", "A scene writes only into the folder of its task.")
def test_a_scene_cannot_write_outside_its_folder(held: Room, tmp_path: Path) -> None:
    outside = tmp_path / "outside.txt"
    with pytest.raises(SceneError, match="Cannot open user file"):
        held.render(f'#fopen F "{outside}" write #write (F, "out") #fclose F\n{BALL}')
    assert not outside.exists()


@pytest.mark.promise("Scenes", "A scene does not change its bundle.")
@pytest.mark.parametrize("way", ["write", "append"])
def test_a_scene_cannot_change_its_bundle(held: Room, way: str) -> None:
    shared = held.bundle / "shared.inc"
    shared.write_text("as it was")
    with pytest.raises(SceneError, match="Cannot open user file"):
        held.render(f'#fopen F "{shared.resolve()}" {way} #write (F, "changed") #fclose F\n{BALL}')
    assert shared.read_text() == "as it was"


def test_a_scene_may_write_into_its_own_folder_and_nothing_of_it_is_kept(held: Room) -> None:
    own = '#fopen F "notes.txt" write #write (F, "7") #fclose F\n#fopen F "notes.txt" read #read (F, N) #fclose F\n'
    held.render(f'{own}#if (N != 7) #error "lost" #end\n{BALL}')
    assert sorted(path.name for path in held.task_dir.iterdir()) == [".povray", "tile.exr", "tile.pov"]


@pytest.mark.promise("Scenes", "A scene connects to nothing.")
def test_nothing_connects_to_the_machines_network(held: Room) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        script = f"exec 3<>/dev/tcp/127.0.0.1/{server.getsockname()[1]}"
        open_room = Room(held.task_dir, held.bundle, Sandbox("none", allow_none=True))
        assert _inside(open_room, "/usr/bin/bash", "-c", script).returncode == 0
        server.accept()[0].close()
        assert _inside(held, "/usr/bin/bash", "-c", script).returncode != 0
        server.settimeout(0)
        with pytest.raises(BlockingIOError):
            server.accept()


@pytest.mark.promise("Scenes", "A scene sees nothing of the environment of the worker.")
def test_the_environment_is_povrays_and_nothing_of_ours(held: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIPPMANN_SECRET", "key")
    names = {line.partition("=")[0] for line in _inside(held, "/usr/bin/env").stdout.splitlines()}
    assert names - {"PWD", "SHLVL", "_", "OLDPWD"} == {"PATH", "LANG", "HOME", "POVINI", "POV_TEMP_DIR"}


@pytest.mark.promise("Scenes", "A scene has no capabilities, also on a worker of root.")
@pytest.mark.skipif(os.geteuid() != 0, reason="only root has capabilities to lose")
def test_root_has_no_capabilities_inside(held: Room) -> None:
    (held.task_dir / "mine").write_text("")
    assert _inside(held, "/usr/bin/chown", "12345", "mine").returncode != 0
    assert (held.task_dir / "mine").stat().st_uid != 12345


@pytest.mark.promise("Scenes", "A scene reaches no other process.")
def test_other_processes_are_out_of_reach(held: Room) -> None:
    with subprocess.Popen(["sleep", "60"]) as victim:
        _inside(held, "/bin/sh", "-c", f"kill -9 {victim.pid}")
        assert victim.poll() is None
        victim.kill()


def test_auto_finds_a_sandbox_that_holds(faults: dict[str, str | None]) -> None:
    found = detect("auto")
    assert found.mode == next((mode for mode in ("bwrap", "landlock") if faults[mode] is None), "none")


def test_a_sandbox_that_does_not_start_is_told_with_its_words(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    broken = tmp_path / "bwrap"
    broken.write_text("#!/bin/sh\necho 'bwrap: No permissions to create new namespace' >&2; exit 1\n")
    broken.chmod(0o755)
    monkeypatch.setattr("worker.sandbox.detect.PATH", f"{tmp_path}:/usr/bin:/bin")
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    with pytest.raises(SandboxMissing, match="No permissions to create new namespace"):
        detect("bwrap")
    assert detect("auto").mode in ("landlock", "none")


def test_a_sandbox_that_holds_nothing_is_found_out() -> None:
    assert trial(Sandbox("none", allow_none=True)) is not None
