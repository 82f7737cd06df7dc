"""Mitsuba as it is installed: its version and the variant that works, found in a child process.

Never in this process: with an LLVM older than 16, Dr.Jit aborts the process that compiles with it.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from worker.sandbox.sandbox import PATH

VARIANT = "llvm_ad_rgb"
"""The variant that is tried. The one of GPUs, `cuda_ad_rgb`, needs devices that the sandbox does not show."""

_PROBE = Path(__file__).with_name("inside") / "probe.py"
_ANSWER_S = 60.0
"""A cold start on a slow machine takes ten seconds."""
_NO_LIBRARY = "LLVM shared library"
_INSTALL = "install libllvm19, or another LLVM of 16 or later"


@dataclass(frozen=True)
class Found:
    """Mitsuba works on this machine."""

    version: str
    variant: str


@dataclass(frozen=True)
class Missing:
    """Mitsuba does not work on this machine."""

    reason: str
    """A part of a sentence: why, and what to install."""


@cache
def mitsuba_version() -> Found | Missing:
    """Return the version of Mitsuba and the variant that works, or why none does; it is found once in each process."""
    if find_spec("mitsuba") is None:
        return Missing("Mitsuba is not installed: install lippmann[mitsuba]")
    return probe(VARIANT)


def environment() -> dict[str, str]:
    """Return all environment variables of the engine; without a home, Dr.Jit keeps no compiled kernels on the disk."""
    return {"PATH": PATH, "LANG": "C.UTF-8", "OPENBLAS_NUM_THREADS": "1"}


def probe(variant: str, more: Mapping[str, str] | None = None) -> Found | Missing:
    """Try one variant in a child process, with more variables in its environment."""
    python = [sys.executable, "-I", "-B", str(_PROBE), variant]
    env = {**environment(), **(more or {})}
    try:
        ran = subprocess.run(python, env=env, capture_output=True, text=True, timeout=_ANSWER_S, check=False)
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
