"""One output being made: what its maker is lent."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from numpy.typing import NDArray

from lippmann.errors import Stopped
from lippmann.job.outputs.output import OutputOptions
from lippmann.plan import artifact_names as names
from worker.tasks.outputs.footage import Footage
from worker.tasks.watch import PartWatched, Watch

Item = TypeVar("Item")


@dataclass(frozen=True)
class Making:
    """An output on its way: its footage, a scratch folder, where its files go, and who watches."""

    footage: Footage
    output: OutputOptions
    scratch: Path
    """Empty at first, gone afterwards."""
    put: Callable[[str, Path], None]
    """Keeps a file whole, or not at all, by its name below the job."""
    is_there: Callable[[str], bool]
    """Whether a file of that name was kept before, by an earlier attempt too."""
    watch: Watch
    kept: list[str] = field(default_factory=list)
    """Names below the job of all files of the output, in the order in which they were made."""

    def name(self, file: str) -> str:
        """Return the name below the job of a file of this output."""
        return f"{names.output_folder(self.output)}/{file}"

    def keep(self, file: str, make: Callable[[Path], None]) -> None:
        """Make a file in the scratch folder and keep it, unless an earlier attempt has.

        Parameters
        ----------
        file
            Its name in the output's folder, as in `0001.png`.
        make
            Writes it to the path that it is given.
        """
        name = self.name(file)
        if not self.is_there(name):
            path = self.scratch / Path(file).name
            make(path)
            self.put(name, path)
            path.unlink()
        self.kept.append(name)

    def told(self, items: Iterable[Item], count: int) -> Iterator[Item]:
        """Yield items and tell how far the work is.

        Raises
        ------
        Stopped
            Between two of them, if the work should end.
        """
        for number, item in enumerate(items):
            self._tell(number / count)
            yield item

    def told_rows(self, bands: Iterable[NDArray[Any]], rows: int) -> Iterator[NDArray[Any]]:
        """Yield bands of so many rows in all, and tell how far the work is; see `told`."""
        done = 0
        for band in bands:
            self._tell(done / rows)
            yield band
            done += len(band)

    def part(self, number: int, count: int) -> Making:
        """Return the making of one of `count` equal parts of the output, counted from 0, for work that takes long."""
        return replace(self, watch=PartWatched(self.watch, number / count, (number + 1) / count))

    def _tell(self, progress: float) -> None:
        if self.watch.should_stop():
            raise Stopped
        self.watch.progress = progress
