"""Mitsuba as it is installed: its version and the variant that works, found in a child process.

Never in this process: with an LLVM older than 16, Dr.Jit aborts the process that compiles with it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from worker.engines.mitsuba.surroundings import CUDA, LLVM, environment, readable
from worker.sandbox.detect import detect
from worker.sandbox.devices import nvidia_devices
from worker.sandbox.limits import Limits

SETTING = "LIPPMANN_MITSUBA"
"""The environment variable with the setting of the worker, which may name the only variant that is tried."""

_PROBE = Path(__file__).with_name("inside") / "probe.py"
_ANSWER_S = 60.0
"""A cold start on a slow machine takes ten seconds."""
_TRIAL_LIMITS = Limits(cpu_s=60, memory_mb=4096)
_NO_LIBRARY = "LLVM shared library"
_INSTALL = "install libllvm19, or another LLVM of 16 or later"


@dataclass(frozen=True)
class Found:
    """Mitsuba works on this machine."""

    version: str
    variant: str
    note: str = ""
    """Why not by the GPU of the machine; empty if by it, or without one."""


@dataclass(frozen=True)
class Missing:
    """Mitsuba does not work on this machine."""

    reason: str
    """A part of a sentence: why, and what to install."""


@cache
def mitsuba_version() -> Found | Missing:
    """Return the version of Mitsuba and the variant that works, or why none does; it is found once in each process.

    The variant of GPUs comes first where there is a GPU of NVIDIA, unless the setting names the one to use.
    """
    if find_spec("mitsuba") is None:
        return Missing("Mitsuba is not installed: install lippmann[mitsuba]")
    wanted = os.environ.get(SETTING)
    if wanted in (LLVM, CUDA):
        return probe(wanted) if wanted == LLVM else probe_gpu()
    if nvidia_devices() is None:
        return probe(LLVM)
    by_gpu = probe_gpu()
    if isinstance(by_gpu, Found):
        return by_gpu
    found = probe(LLVM)
    return replace(found, note=by_gpu.reason) if isinstance(found, Found) else found


def probe(variant: str, more: Mapping[str, str] | None = None) -> Found | Missing:
    """Try one variant in a child process, with more variables in its environment."""
    return _tried(variant, _command(variant), environment(variant) | dict(more or {}))


def probe_gpu() -> Found | Missing:
    """Try the variant of GPUs in a child process in a sandbox, as it renders, with the devices of the GPU."""
    devices = nvidia_devices()
    if devices is None:
        return Missing(f"the variant {CUDA} needs a GPU of NVIDIA with its driver: there is no /dev/nvidiactl")
    with tempfile.TemporaryDirectory(prefix="lippmann-gpu-") as name:
        work = Path(name, "work")
        work.mkdir()
        Path(name).chmod(0o755)
        # The program of the trial is ours, so it may run without a sandbox where none works.
        sandbox = replace(detect("auto"), allow_none=True)
        line = sandbox.wrap(
            _command(CUDA), readable=[*readable(), _PROBE], writable=work, limits=_TRIAL_LIMITS, devices=devices
        )
        return _tried(CUDA, line, environment(CUDA), cwd=work)


def _command(variant: str) -> list[str]:
    python = Path(sys.prefix).resolve() / "bin" / Path(sys.executable).name
    return [str(python), "-I", "-B", str(_PROBE), variant]


def _tried(variant: str, command: list[str], env: Mapping[str, str], *, cwd: Path | None = None) -> Found | Missing:
    try:
        ran = subprocess.run(
            command, cwd=cwd, env=env, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=_ANSWER_S
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return Missing(f"its trial did not end well: {error}")
    said = ran.stdout.strip()
    if ran.returncode == 0 and said and said != "wrong":
        return Found(said, variant)
    if variant.startswith("llvm") and (_NO_LIBRARY in ran.stderr or ran.returncode < 0):
        return Missing(f"no LLVM 16 or later that works: {_INSTALL}")
    return Missing(f"the variant {variant} does not work: {_last_line(ran.stderr) or f'exit code {ran.returncode}'}")


def _last_line(text: str) -> str:
    return (text.strip().splitlines() or [""])[-1][:300]
