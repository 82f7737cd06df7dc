"""Devices that a sandbox shows to one program beside the plain ones, such as those of a GPU."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Devices:
    """Device files, with the files of the kernel that describe them.

    A program with devices may map files shared, as drivers do, and its address space is not limited, since drivers
    reserve far more than they use: its memory is limited by totals alone.
    """

    files: tuple[Path, ...]
    """The device files, which the program reads and writes."""
    described_in: tuple[Path, ...] = ()
    """The files and folders of the kernel that it reads."""


def nvidia_devices(root: Path = Path("/")) -> Devices | None:
    """Return the devices of NVIDIA's driver below a root folder; None without a GPU."""
    folder = root / "dev"
    gpus = [path for path in folder.glob("nvidia[0-9]*") if path.name.removeprefix("nvidia").isdecimal()]
    if not gpus or not (folder / "nvidiactl").exists():
        return None
    shared = [path for name in ("nvidiactl", "nvidia-uvm", "nvidia-uvm-tools") if (path := folder / name).exists()]
    described_in = [path for name in ("proc/driver/nvidia",) if (path := root / name).exists()]
    return Devices(files=(*shared, *sorted(gpus)), described_in=tuple(described_in))
