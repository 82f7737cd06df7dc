"""POV-Ray's progress, read from its messages.

===================================== ================================================================
Parsing 8190K tokens                  about once a second while parsing; no line for a short scene
Photon count 1949402                  while photons are shot; no total
Rendered 1024 of 30000 pixels (3%)    after each block of 32 x 32 px. A radiosity pretrace prints the same,
                                      in smaller steps and up to any share; then the count starts again
===================================== ================================================================

A scene can print any of these lines. So the phases only go forward, a line about another number of pixels than those of
the picture is no progress, and neither tokens nor photons count as growth, because they may grow without end. A number
of more digits than POV-Ray prints is text.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from enum import StrEnum

PRETRACE_SHARE = 0.3
"""The share of the progress that a radiosity pretrace takes; POV-Ray does not report how long it will last."""

# Python refuses to convert thousands of digits, and other digits than those of ASCII are never printed by POV-Ray.
_RENDERED = re.compile(r"Rendered (\d{1,12}) of (\d{1,12}) pixels", re.ASCII)
_PARSING = re.compile(r"Parsing (\d{1,12})K tokens", re.ASCII)
_PHOTONS = re.compile(r"Photon count (\d{1,18})(?!\d)", re.ASCII)
_RADIOSITY_TIME = re.compile(r"\s*Radiosity Time:\s+\d")
_PHOTON_TIME = re.compile(r"\s*Photon Time:\s+\d")


class Phase(StrEnum):
    """The phase in which POV-Ray is."""

    STARTING = "starting"
    PARSING = "parsing"
    PREPARING = "preparing"
    """The scene is parsed, and nothing is traced yet."""
    PHOTONS = "photons"
    PRETRACE = "pretrace"
    RENDERING = "rendering"


_ORDER = tuple(Phase)


@dataclass(frozen=True)
class Progress:
    """The phase and the share of the work that is done."""

    phase: Phase = Phase.STARTING
    fraction: float = 0.0
    """The share that is done, 0 to 1; it never falls."""
    count: int = 0
    """Thousands of tokens, or photons, or pixels, of this phase; it changes while POV-Ray works."""
    radiosity: bool = False
    photons: bool = False


class PovrayProgressReader:
    """Reads POV-Ray's progress from its output; a `worker.sandbox.process.ProgressReader`.

    Parameters
    ----------
    first_block_px
        Pixels of the first block that POV-Ray reports: fewer in the first report mean a radiosity pretrace.
    total_px
        Pixels of the picture that are traced.
    """

    def __init__(self, *, first_block_px: int, total_px: int) -> None:
        self.progress = Progress()
        self._first_block_px = first_block_px
        self._total_px = total_px

    @property
    def phase(self) -> str:
        """The phase in which POV-Ray is."""
        return self.progress.phase

    @property
    def growth(self) -> float:
        """The share of the pixels that are traced."""
        return self.progress.fraction

    def read(self, line: str) -> bool:
        """Update the progress from the next line of output; return whether the line reports nothing else."""
        after = advance(self.progress, line, first_block_px=self._first_block_px, total_px=self._total_px)
        if _ORDER.index(after.phase) >= _ORDER.index(self.progress.phase):
            self.progress = after
        return is_progress(line)


def is_progress(line: str) -> bool:
    """Return whether a line reports progress and nothing else."""
    return any(pattern.match(line) for pattern in (_RENDERED, _PARSING, _PHOTONS))


def advance(progress: Progress, line: str, *, first_block_px: int, total_px: int) -> Progress:
    """Return the progress after one more line.

    >>> advance(Progress(), "Rendered 1024 of 4096 pixels (25%)", first_block_px=1024, total_px=4096).fraction
    0.25
    """
    if match := _RENDERED.match(line):
        if int(match[2]) != total_px or int(match[1]) > total_px:
            return progress
        return _rendered(progress, int(match[1]), total_px, first_block_px)
    if match := _PARSING.match(line):
        return replace(progress, phase=Phase.PARSING, count=int(match[1]))
    if match := _PHOTONS.match(line):
        return replace(progress, phase=Phase.PHOTONS, count=int(match[1]), photons=True)
    if line.startswith("==== [Parsing..."):
        return replace(progress, phase=Phase.PARSING)
    if line.startswith("==== [Rendering..."):
        return replace(progress, phase=Phase.PREPARING, count=0)
    if _RADIOSITY_TIME.match(line):
        return replace(progress, radiosity=True)
    if _PHOTON_TIME.match(line):
        return replace(progress, photons=True)
    return progress


def _rendered(progress: Progress, done_px: int, total_px: int, first_block_px: int) -> Progress:
    phase = progress.phase
    if phase not in (Phase.PRETRACE, Phase.RENDERING):
        # A pretrace traces only a few pixels of each block.
        phase = Phase.PRETRACE if done_px < first_block_px else Phase.RENDERING
    begun_anew = phase is Phase.PRETRACE and done_px < progress.count
    if begun_anew:
        phase = Phase.RENDERING
    radiosity = progress.radiosity or begun_anew
    share = done_px / total_px
    if phase is Phase.PRETRACE:
        share *= PRETRACE_SHARE
    elif radiosity:
        share = PRETRACE_SHARE + (1 - PRETRACE_SHARE) * share
    fraction = min(1.0, max(progress.fraction, share))
    return replace(progress, phase=phase, fraction=fraction, count=done_px, radiosity=radiosity)
