"""Small disks of their own for tests, which only root may mount."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.waiting import ENOUGH_S


@dataclass(frozen=True)
class Disk:
    """A file system in memory, mounted on a folder."""

    path: Path

    def fill(self, *, but_bytes: int = 0) -> None:
        """Fill the disk with one file, and leave `but_bytes` free."""
        with suppress(OSError), (self.path / "fill").open("wb", buffering=0) as file:
            while (free := shutil.disk_usage(self.path).free - but_bytes) > 0:
                file.write(bytes(min(free, 1 << 20)))

    def use_up_inodes(self) -> None:
        """Make as many files as the disk has inodes for."""
        folder = self.path / "many"
        with suppress(OSError):
            folder.mkdir()
            for number in range(1_000_000):
                (folder / str(number)).touch()

    def free(self) -> None:
        """Delete what `fill` and `use_up_inodes` made."""
        (self.path / "fill").unlink(missing_ok=True)
        shutil.rmtree(self.path / "many", ignore_errors=True)


@contextmanager
def small_disk(path: Path, *, mb: int, inodes: int = 100_000) -> Iterator[Disk]:
    """Mount a small disk on a new folder."""
    path.mkdir()
    options = f"size={mb}m,nr_inodes={inodes}"
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(path)], capture_output=True, text=True, timeout=ENOUGH_S
    )
    if mounted.returncode:
        pytest.skip(f"cannot mount a small disk: {mounted.stderr.strip()}")
    try:
        yield Disk(path)
    finally:
        subprocess.run(["umount", "--lazy", str(path)], check=True, timeout=ENOUGH_S)


@contextmanager
def read_only(folder: Path) -> Iterator[None]:
    """Let a folder be read-only, also for root; files that are open stay as they are."""
    for options in (["--bind", str(folder), str(folder)], ["-o", "remount,bind,ro", str(folder)]):
        subprocess.run(["mount", *options], check=True, timeout=ENOUGH_S)
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True, timeout=ENOUGH_S)


@contextmanager
def away(folder: Path) -> Iterator[None]:
    """Let a folder not be there, as when a disk is unmounted."""
    aside = folder.with_name(f"{folder.name}.away")
    folder.rename(aside)
    try:
        yield
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        aside.rename(folder)
