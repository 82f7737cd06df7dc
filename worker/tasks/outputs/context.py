"""The context of the maker of an output: the frames, a scratch folder, the store and the progress monitor."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from numpy.typing import NDArray

from lippmann.errors import Stopped
from lippmann.job.outputs.output import OutputOptions
from lippmann.plan import artifact_names as names
from worker.tasks.attempts.monitor import PartMonitor, ProgressMonitor
from worker.tasks.outputs.frame_source import FrameSource

Item = TypeVar("Item")


@dataclass(frozen=True)
class OutputContext:
    """One output that is being made."""

    source: FrameSource
    output: OutputOptions
    scratch: Path
    """An empty folder that is removed afterwards."""
    put: Callable[[str, Path], None]
    """Stores a file by its name below the job, completely or not at all."""
    exists: Callable[[str], bool]
    """Returns whether a file of that name below the job is stored; an earlier attempt may have stored it."""
    monitor: ProgressMonitor
    stored: list[str] = field(default_factory=list)
    """The names below the job of all files of the output, in the order in which they were made."""

    def name(self, file: str) -> str:
        """Return the name of a file of this output below the job."""
        return f"{names.output_folder(self.output)}/{file}"

    def store_file(self, file: str, make: Callable[[Path], None]) -> None:
        """Make a file in the scratch folder and store it, unless an earlier attempt has stored it.

        A file that is made when the work should end is not stored: the next attempt may be for other frames, and would
        take it for its own.

        Parameters
        ----------
        file
            The name in the folder of the output, as in `0001.png`.
        make
            Writes the file to the path that it receives.

        Raises
        ------
        Stopped
            If the work should end when the file is made.
        """
        name = self.name(file)
        if not self.exists(name):
            path = self.scratch / Path(file).name
            make(path)
            self._check_stop()
            self.put(name, path)
            path.unlink()
        self.stored.append(name)

    def with_progress(self, items: Iterable[Item], count: int) -> Iterator[Item]:
        """Yield items and report the progress, in `count` equal steps.

        Raises
        ------
        Stopped
            Between two items, if the work should end.
        """
        for number, item in enumerate(items):
            self._report(number / count)
            yield item

    def rows_with_progress(self, bands: Iterable[NDArray[Any]], rows: int) -> Iterator[NDArray[Any]]:
        """Yield bands that have `rows` rows in all, and report the progress; see `with_progress`."""
        done = 0
        for band in bands:
            self._report(done / rows)
            yield band
            done += len(band)

    def part(self, number: int, count: int) -> OutputContext:
        """Return the context for one of `count` equal parts of the output, counted from 0."""
        return replace(self, monitor=PartMonitor(self.monitor, number / count, (number + 1) / count))

    def _report(self, progress: float) -> None:
        self._check_stop()
        self.monitor.progress = progress

    def _check_stop(self) -> None:
        if self.monitor.should_stop():
            raise Stopped
