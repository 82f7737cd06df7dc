"""A frame's masters on their way into the store: held in memory while they are small, read back from disk else."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import Stopped
from lippmann.job.resolved import ResolvedJob
from lippmann.lightfield.sheet.bands import HeldRows, Rows
from lippmann.plan import artifact_names as names
from worker.images.bands.rows import BAND_PX, open_rows
from worker.images.bands.scratch import scratch_rows
from worker.images.write import write_channels, write_exr_rows
from worker.tasks.attempts.artifacts import TaskArtifacts
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames.render import header

SOON_PX = 6_000_000
"""The pixels of masters that are stored in the time that the next attempt takes until POV-Ray parses, 0.4 s: three
masters of 5.76 million pixels take 1.0 s (measured)."""


@dataclass
class Masters:
    """The masters of one frame, written and read in bands of rows, so that about `BAND_PX` are in memory at once."""

    place: Workplace
    sheet: ResolvedJob
    frame: int
    folder: Path
    """The folder of unfinished files, which is removed with the task."""
    artifacts: TaskArtifacts
    monitor: ProgressMonitor
    count: int
    """The number of masters that will be stored, for the progress."""
    opened: ExitStack
    """Holds the open files from which others are made."""
    _kept: int = 0
    _is_announced: bool = False

    def keep(
        self, name: str, bands: Iterable[NDArray[np.float16]], size: tuple[int, int], *, kind: str | None = None
    ) -> Rows:
        """Store a master by its name below the job, and return its rows, for what is made of it.

        Parameters
        ----------
        name
            The name below the job, such as `names.integral_name`.
        bands
            Bands of its rows, top down: `(rows, cols, 3)` each, linear light.
        size
            The size (rows, cols).
        kind
            `names.PSEUDOSCOPIC` or `names.ORTHOSCOPIC` for an integral image, which goes into its header.

        Raises
        ------
        Stopped
            Between two bands, if the work should end.
        """
        path = self.folder / f"master-{self._kept}.exr"
        told = self._told(bands, size)
        held = _held(told) if size[0] * size[1] <= BAND_PX else None
        told = iter((held.pixels,)) if held else told
        attributes = header(self.sheet, self.frame) | ({} if kind is None else {names.KIND: kind})
        write_exr_rows(path, told, size=size, attributes=attributes)
        self._store(name, path)
        if held is None:
            return self.opened.enter_context(open_rows(path, dtype=np.float16))
        path.unlink()
        return held

    def keep_channels(
        self,
        name: str,
        bands: Iterable[NDArray[np.float32]],
        size: tuple[int, int],
        channels: Sequence[str],
        *,
        attributes: Mapping[str, str] | None = None,
    ) -> None:
        """Store a master of numbers, `(rows, cols, channel)`, from which nothing else is made; see `keep`.

        Parameters
        ----------
        channels
            The names of the numbers.
        attributes
            Header attributes besides those of every master.
        """
        path = self.folder / "numbers.exr"
        told = self._told(bands, size)
        said = header(self.sheet, self.frame) | dict(attributes or {})
        write_channels(path, told, channels, size=size, attributes=said)
        self._store(name, path)
        path.unlink()

    def aside(self, bands: Iterable[NDArray[np.float32]], size: tuple[int, int], channels: int) -> Rows:
        """Return rows that can be read in any order from bands that come from the top; nothing is stored."""
        rows, cols = size
        if rows * cols * channels <= BAND_PX:
            return _held(bands)
        room = scratch_rows(self.folder, rows=rows, cols=cols, channels=channels, dtype=np.float32)
        kept, done = self.opened.enter_context(room), 0
        for band in bands:
            self._ask()
            kept.write(done, band)
            done += len(band)
        return kept

    def _store(self, name: str, path: Path) -> None:
        self.artifacts.put(name, path)
        self._kept += 1

    def _told(self, bands: Iterable[NDArray[Any]], size: tuple[int, int]) -> Iterator[NDArray[Any]]:
        rows, cols = size
        done = 0
        for band in bands:
            self._announce_end((self.count - self._kept) * rows * cols - done * cols)
            self._ask()
            yield band
            done += len(band)
            self.monitor.progress = (self._kept + done / rows) / self.count

    def _announce_end(self, left_px: int) -> None:
        """Announce the end of the attempt once few pixels are left, so that the next POV-Ray starts meanwhile."""
        if not self._is_announced and left_px <= SOON_PX:
            self._is_announced = True
            self.monitor.announce_end()

    def _ask(self) -> None:
        if self.monitor.should_stop():
            raise Stopped


def _held(bands: Iterable[NDArray[Any]]) -> HeldRows:
    return HeldRows(np.concatenate(list(bands)))
