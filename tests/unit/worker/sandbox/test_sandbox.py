"""The command lines of the sandbox, as exact lists."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from lippmann.errors import SandboxMissing
from worker.sandbox import landlock
from worker.sandbox import sandbox as sandbox_module
from worker.sandbox.detect import detect, python_folders, python_inside, trial
from worker.sandbox.devices import Devices, nvidia_devices
from worker.sandbox.limits import Limits
from worker.sandbox.sandbox import Sandbox, SandboxMode

LIMITS = Limits(cpu_s=99.5, memory_mb=512, file_mb=2)
HELD = [
    *("prlimit", "--core=0", "--cpu=100:105", "--as=536870912", "--fsize=2097152"),
    *("--nofile=256", "--msgqueue=0", "--rtprio=0"),
]
USER = 61_234


@pytest.fixture(autouse=True)
def _names_that_do_not_change(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sandbox_module, "filter_path", _filter_name)
    monkeypatch.setattr(sandbox_module, "own_user", lambda folder: None)


def _filter_name(*, forks: bool, maps_shared: bool = False) -> str:
    return f"/filter/{forks}{'/shared' if maps_shared else ''}"


def _wrapped(
    sandbox: Sandbox,
    *,
    readable: tuple[str, ...] = ("/scenes/fish",),
    writable: str = "/work/7",
    devices: Devices | None = None,
) -> list[str]:
    paths, words = [Path(path) for path in readable], ["povray", "+Ia b.pov"]
    return sandbox.wrap(words, readable=paths, writable=Path(writable), limits=LIMITS, devices=devices)


def test_bwrap_shows_the_system_the_scene_and_one_writable_folder() -> None:
    assert _wrapped(Sandbox("bwrap")) == [
        *("/bin/sh", "-c", 'exec 9<"$1"; shift; exec "$@"', "sandbox", "/filter/True"),
        "bwrap",
        *("--seccomp", "9"),
        "--unshare-all",
        *("--cap-drop", "ALL"),
        "--die-with-parent",
        "--new-session",
        "--as-pid-1",
        *("--ro-bind", "/usr", "/usr"),
        *("--ro-bind-try", "/bin", "/bin"),
        *("--ro-bind-try", "/lib", "/lib"),
        *("--ro-bind-try", "/lib64", "/lib64"),
        *("--ro-bind-try", "/etc/ld.so.cache", "/etc/ld.so.cache"),
        *("--dev", "/dev"),
        *("--dir", "/scenes", "--dir", "/work"),
        *("--ro-bind", "/scenes/fish", "/scenes/fish"),
        *("--bind", "/work/7", "/work/7"),
        *("--remount-ro", "/dev", "--remount-ro", "/"),
        *("--chdir", "/work/7"),
        "--",
        *("/bin/sh", "-c", '"$@"; exit $?', "sh"),
        *HELD,
        "--nproc=64",
        "--",
        "povray",
        "+Ia b.pov",
    ]


GPU = Devices((Path("/dev/nvidiactl"), Path("/dev/nvidia0")), (Path("/proc/driver/nvidia"),))


def test_the_devices_of_a_gpu_come_with_files_mapped_shared_and_without_a_limit_of_the_address_space() -> None:
    plain, line = _wrapped(Sandbox("bwrap")), _wrapped(Sandbox("bwrap"), devices=GPU)
    added = [word for word in line if word not in plain]
    assert added == [
        "/filter/True/shared",
        *("/proc", "/proc/driver"),
        *("--dev-bind", "/dev/nvidia0", "/dev/nvidia0"),
        *("--dev-bind", "/dev/nvidiactl", "/dev/nvidiactl"),
        *("/proc/driver/nvidia", "/proc/driver/nvidia"),
    ]
    assert [word for word in plain if word not in line] == ["/filter/True", "--as=536870912"]
    assert _wrapped(Sandbox("landlock"), devices=GPU)[4 : -len(HELD) - 2] == [
        *("--filter", "/filter/False/shared"),
        *("--read", "/scenes/fish", "--read", "/proc/driver/nvidia"),
        *("--device", "/dev/nvidiactl", "--device", "/dev/nvidia0"),
        *("--write", "/work/7"),
        "--",
    ]


def test_the_devices_of_nvidia_are_found_where_there_is_a_gpu(tmp_path: Path) -> None:
    (tmp_path / "dev").mkdir()
    for name in ("nvidiactl", "nvidia-uvm", "nvidia-modeset"):
        (tmp_path / "dev" / name).touch()
    assert nvidia_devices(tmp_path) is None
    (tmp_path / "dev/nvidia1").touch()
    (tmp_path / "proc/driver/nvidia").mkdir(parents=True)
    found = nvidia_devices(tmp_path)
    assert found is not None
    assert [path.name for path in found.files] == ["nvidiactl", "nvidia-uvm", "nvidia1"]
    assert found.described_in == (tmp_path / "proc/driver/nvidia",)


_USES_A_DEVICE = """
import mmap, os, sys
device = os.path.exists(sys.argv[1]) and os.open(sys.argv[1], os.O_RDWR) >= 0
open("a", "wb").write(b"x" * 4096)
try:
    mmap.mmap(os.open("a", os.O_RDWR), 4096)
    print(device, True)
except PermissionError:
    print(device, False)
"""


@pytest.mark.parametrize("mode", ["bwrap", "landlock"])
def test_a_program_uses_the_devices_that_it_is_given_and_no_others(
    tmp_path: Path, mode: SandboxMode, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.undo()
    if trial(Sandbox(mode)) is not None:
        pytest.skip(f"{mode} does not hold on this machine")
    # A device without an effect, under a name that no sandbox shows; not every machine lets one be made.
    device = tmp_path / "device"
    try:
        os.mknod(device, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
        os.close(os.open(device, os.O_RDWR))
    except PermissionError:
        pytest.skip("this machine lets nobody make a device")
    device.chmod(0o666)
    for folder in (tmp_path, *list(tmp_path.parents)[:2]):
        folder.chmod(0o755)
    work = tmp_path / "work"
    work.mkdir()

    def answer(devices: Devices | None) -> str:
        argv = [*python_inside(), "-c", _USES_A_DEVICE, str(device)]
        line = Sandbox(mode).wrap(
            argv, readable=python_folders(), writable=work, limits=Limits(cpu_s=20, memory_mb=512), devices=devices
        )
        ran = subprocess.run(line, cwd=work, capture_output=True, text=True)
        return ran.stdout.strip() or ran.stderr.strip().splitlines()[-1]

    assert answer(Devices((device,))) == "True True"
    without = answer(None)
    assert without == "False False" or "Permission denied" in without


def test_landlock_is_a_file_of_its_own_run_by_this_python() -> None:
    assert _wrapped(Sandbox("landlock")) == [
        sys.executable,
        "-I",
        "-S",
        landlock.__file__,
        *("--filter", "/filter/False"),
        *("--read", "/scenes/fish"),
        *("--write", "/work/7"),
        "--",
        *HELD,
        "--",
        "povray",
        "+Ia b.pov",
    ]


def test_a_worker_that_is_root_runs_the_program_as_a_user_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sandbox_module, "own_user", lambda folder: USER)
    line = _wrapped(Sandbox("bwrap"))
    rights = line[line.index("--unshare-ipc") : line.index("--die-with-parent")]
    assert rights == [
        *("--unshare-ipc", "--unshare-pid", "--unshare-net", "--unshare-uts", "--unshare-cgroup-try"),
        *("--cap-drop", "ALL", "--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID"),
    ]
    program = line[line.index("--", line.index("--chdir")) + 1 :]
    ids = [f"--reuid={USER}", f"--regid={USER}", "--clear-groups"]
    changed = ["setpriv", *ids, "--inh-caps=-all", "--no-new-privs", "--"]
    assert program[4:] == [*changed, *HELD, "--nproc=64", "--", "povray", "+Ia b.pov"]


def test_landlock_changes_the_user_only_where_the_user_can_reach_the_folders(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(sandbox_module, "own_user", lambda folder: os.getuid())
    (tmp_path / "task").mkdir()
    for mode, changes in ((0o755, True), (0o700, False)):
        tmp_path.chmod(mode)
        monkeypatch.setattr(sandbox_module, "is_open_to_all", lambda paths: tmp_path.stat().st_mode & 1 == 1)
        line = _wrapped(Sandbox("landlock"), readable=(), writable=str(tmp_path / "task"))
        assert (["--user", str(os.getuid())] == line[6:8], "--nproc=64" in line) == (changes, changes)


def test_without_a_sandbox_a_scene_is_refused() -> None:
    with pytest.raises(SandboxMissing):
        _wrapped(Sandbox("none"))
    with pytest.raises(SandboxMissing, match="uploaded scene"):
        _wrapped(detect("none"))


def test_a_sandbox_that_cannot_be_tried_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker ends with this error; it would go on with any other."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "away"))
    with pytest.raises(SandboxMissing, match=r"to try a sandbox with, got: .*No such file"):
        detect("auto")


def test_without_a_sandbox_an_allowed_scene_still_has_its_limits_and_dies_with_its_worker() -> None:
    line = _wrapped(Sandbox("none", allow_none=True))
    assert line == ["setpriv", "--pdeathsig", "KILL", "--no-new-privs", "--", *HELD, "--", "povray", "+Ia b.pov"]


def test_a_folder_inside_another_is_mounted_after_it() -> None:
    line = _wrapped(Sandbox("bwrap"), readable=("/b/c/d", "/b"), writable="/b/a")
    mounts = [line[at + 1] for at, word in enumerate(line) if word in ("--bind", "--ro-bind")]
    assert mounts == ["/usr", "/b", "/b/a", "/b/c/d"]


@pytest.mark.parametrize("mode", ["bwrap", "landlock", "none"])
def test_a_read_only_path_inside_the_writable_one_is_refused(mode: SandboxMode) -> None:
    with pytest.raises(ValueError, match="outside the writable"):
        _wrapped(Sandbox(mode, allow_none=True), readable=("/work/7/scene",))


@pytest.mark.parametrize("mode", ["bwrap", "landlock", "none"])
def test_a_relative_path_is_refused(mode: SandboxMode) -> None:
    with pytest.raises(ValueError, match="absolute"):
        _wrapped(Sandbox(mode, allow_none=True), readable=("scene",))
