"""The surroundings of a program of Mitsuba in the sandbox: its environment, the folders that it reads, and devices."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from worker.sandbox.devices import Devices, nvidia_devices
from worker.sandbox.sandbox import PATH

LLVM, CUDA = "llvm_ad_rgb", "cuda_ad_rgb"
"""The variants of Mitsuba: for processors, and for GPUs of NVIDIA."""

PACKAGES = [Path(__file__).resolve().parents[3] / name for name in ("lippmann", "worker")]
"""Our packages that the program imports."""


def environment(variant: str = LLVM) -> dict[str, str]:
    """Return all environment variables of the program; without a home, Dr.Jit keeps no compiled kernels on the disk."""
    found = {"PATH": PATH, "LANG": "C.UTF-8", "OPENBLAS_NUM_THREADS": "1"}
    # The driver would write what it compiles below the home, where nothing can be written.
    return found | ({"CUDA_CACHE_DISABLE": "1"} if variant == CUDA else {})


def readable(packages: Iterable[Path] = ()) -> list[Path]:
    """Return what the program reads besides its folders: Python with its libraries, and some packages of ours."""
    pythons = {Path(sys.prefix).resolve(), Path(sys.base_prefix).resolve()}
    places = sorted(place for place in pythons if not place.is_relative_to("/usr"))
    return [*places, *(path for path in packages if not any(map(path.is_relative_to, [*places, Path("/usr")])))]


def devices_of(variant: str) -> Devices | None:
    """Return the devices that a variant uses; None if it uses none, or there are none."""
    return nvidia_devices() if variant == CUDA else None
