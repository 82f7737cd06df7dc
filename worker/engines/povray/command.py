"""POV-Ray's command line, made by a pure function.

Every option that matters is on it, because POV-Ray's defaults come from an INI file that may be anyone's.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from lippmann.job.rendering.render_settings import Antialias
from worker.engines.engine import Region

PictureFormat = Literal["ppm16", "exr"]

SYSTEM_INCLUDE = Path("/usr/share/povray-3.7/include")
"""The folder of colors.inc and the other includes of Debian's package; without an INI file POV-Ray searches none."""

_PLAIN = re.compile(r"[\w./+-]*")
"""A path that needs no quotation marks."""

BLOCK_PX = 32
"""POV-Ray renders and reports in blocks of 32 x 32 px."""

_OUTPUT = {"ppm16": ("+FP16", "File_Gamma=1.0"), "exr": ("+FE",)}
"""Both formats store linear light: the codes of a PPM are numbers, for targets that encode positions and for depth."""

SUFFIXES: Mapping[PictureFormat, str] = {"ppm16": ".ppm", "exr": ".exr"}
"""The suffix of the picture by its format."""


@dataclass(frozen=True)
class RenderCommand:
    """A picture that POV-Ray renders from a .pov, both in the folder of the task.

    With a `region`, POV-Ray still writes the full size and leaves the rest black.
    """

    pov_file: str
    picture: str
    cols: int
    rows: int
    picture_format: PictureFormat = "exr"
    region: Region | None = None
    clock: float = 0.0
    """POV-Ray keeps it as a 32-bit float."""
    declares: Mapping[str, float] = field(default_factory=dict)
    library_paths: tuple[Path, ...] = (SYSTEM_INCLUDE,)
    antialias: Antialias | None = None
    quality: int | None = None
    """The option +Q; None for the best. Up to 8, there is neither radiosity, nor photons, nor media."""
    threads: int = 1
    program: str = "povray"

    def __post_init__(self) -> None:
        """Refuse values with which POV-Ray renders a wrong picture without an error."""
        values = {"clock": self.clock, **self.declares}
        endless = {name: value for name, value in values.items() if not math.isfinite(value)}
        if endless:
            raise ValueError(f"expected finite numbers for POV-Ray, got {endless}")
        row_start, row_stop, col_start, col_stop = self.traced
        if not (0 <= row_start < row_stop <= self.rows and 0 <= col_start < col_stop <= self.cols):
            raise ValueError(f"expected a region inside {self.rows} x {self.cols} px, got {self.traced}")

    @property
    def traced(self) -> Region:
        """The pixels that are traced."""
        return self.region or Region(0, self.rows, 0, self.cols)

    @property
    def traced_px(self) -> int:
        """The number of pixels that are traced."""
        row_start, row_stop, col_start, col_stop = self.traced
        return (row_stop - row_start) * (col_stop - col_start)

    @property
    def first_block_px(self) -> int:
        """Pixels of the first block that POV-Ray reports."""
        row_start, row_stop, col_start, col_stop = self.traced
        return min(BLOCK_PX, row_stop - row_start) * min(BLOCK_PX, col_stop - col_start)


def povray_argv(command: RenderCommand) -> list[str]:
    """Return the exact command line: no window, no pause, progress on stderr."""
    return [
        command.program,
        f"+I{command.pov_file}",
        f"+O{command.picture}",
        *_OUTPUT[command.picture_format],
        f"+W{command.cols}",
        f"+H{command.rows}",
        *_region_options(command.region),
        "-D",
        "-P",
        *_antialias_options(command.antialias),
        *([] if command.quality is None else [f"+Q{command.quality}"]),
        "+V",
        f"+WT{command.threads}",
        f"+K{_number(command.clock)}",
        *(f"Declare={name}={_number(value)}" for name, value in sorted(command.declares.items())),
        *(f"+L{_quoted(path)}" for path in command.library_paths),
    ]


def _region_options(region: Region | None) -> list[str]:
    if region is None:
        return []
    return [
        f"+SR{region.row_start + 1}",
        f"+ER{region.row_stop}",
        f"+SC{region.col_start + 1}",
        f"+EC{region.col_stop}",
    ]


def _antialias_options(antialias: Antialias | None) -> list[str]:
    """Return the options, without jitter: the same command must give the same picture."""
    if antialias is None:
        return ["-A"]
    return [f"+A{_number(antialias.threshold)}", f"+AM{antialias.method}", f"+R{antialias.depth}", "-J"]


def _quoted(path: Path) -> str:
    """Return a path as POV-Ray reads it, which takes a blank and other signs for the end of an option."""
    return str(path) if _PLAIN.fullmatch(str(path)) else f'"{path}"'


def _number(value: float) -> str:
    return repr(float(value))
