"""The command lines of the sandbox, as exact lists."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from lippmann.errors import SandboxMissing
from worker.sandbox import landlock
from worker.sandbox.limits import Limits
from worker.sandbox.sandbox import Sandbox, SandboxMode, detect

LIMITS = Limits(cpu_s=99.5, memory_mb=512, file_mb=2)
HELD = ["prlimit", "--core=0", "--cpu=100:105", "--as=536870912", "--fsize=2097152"]


def _wrapped(
    sandbox: Sandbox, *, readable: tuple[str, ...] = ("/scenes/fish",), writable: str = "/work/7"
) -> list[str]:
    paths = [Path(path) for path in readable]
    return sandbox.wrap(["povray", "+Ia b.pov"], readable=paths, writable=Path(writable), limits=LIMITS)


def test_bwrap_shows_the_system_the_scene_and_one_writable_folder() -> None:
    assert _wrapped(Sandbox("bwrap")) == [
        "bwrap",
        "--unshare-all",
        "--die-with-parent",
        "--new-session",
        "--as-pid-1",
        *("--cap-drop", "ALL"),
        *("--ro-bind", "/usr", "/usr"),
        *("--ro-bind-try", "/bin", "/bin"),
        *("--ro-bind-try", "/lib", "/lib"),
        *("--ro-bind-try", "/lib64", "/lib64"),
        *("--ro-bind-try", "/etc/ld.so.cache", "/etc/ld.so.cache"),
        *("--dev", "/dev"),
        *("--size", "67108864", "--tmpfs", "/tmp"),
        *("--ro-bind", "/scenes/fish", "/scenes/fish"),
        *("--bind", "/work/7", "/work/7"),
        *("--chdir", "/work/7"),
        "--",
        *("/bin/sh", "-c", '"$@"; exit $?', "sh"),
        *HELD,
        "--nproc=64",
        "--",
        "povray",
        "+Ia b.pov",
    ]


def test_landlock_is_a_file_of_its_own_run_by_this_python() -> None:
    assert _wrapped(Sandbox("landlock")) == [
        sys.executable,
        "-I",
        "-S",
        landlock.__file__,
        *("--read", "/scenes/fish"),
        *("--write", "/work/7"),
        "--",
        *HELD,
        "--",
        "povray",
        "+Ia b.pov",
    ]


def test_without_a_sandbox_a_scene_is_refused() -> None:
    with pytest.raises(SandboxMissing):
        _wrapped(Sandbox("none"))
    with pytest.raises(SandboxMissing, match="uploaded scene"):
        _wrapped(detect("none"))


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
