r"""How far POV-Ray is, read from its messages: lines that end with \r or \n.

===================================== ================================================================
Parsing 8190K tokens                  about once a second while parsing; nothing for a short scene
Photon count 1949402                  while photons are shot; no total
Rendered 1024 of 30000 pixels (3%)    after each block of 32 x 32 px. A radiosity pretrace says the same,
                                      in smaller steps and up to any share, and then the count begins anew
===================================== ================================================================
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from enum import StrEnum

PRETRACE_SHARE = 0.3
"""How much of the bar a radiosity pretrace gets; POV-Ray does not say how long it will take."""

_RENDERED = re.compile(r"Rendered (\d+) of (\d+) pixels")
_PARSING = re.compile(r"Parsing (\d+)K tokens")
_PHOTONS = re.compile(r"Photon count (\d+)")
_RADIOSITY_TIME = re.compile(r"\s*Radiosity Time:\s+\d")
_PHOTON_TIME = re.compile(r"\s*Photon Time:\s+\d")

MAX_LINE_BYTES = 16_384
"""A scene can print a line without end; it is cut here."""


class Phase(StrEnum):
    """What POV-Ray is doing."""

    STARTING = "starting"
    PARSING = "parsing"
    PHOTONS = "photons"
    PRETRACE = "pretrace"
    RENDERING = "rendering"


@dataclass(frozen=True)
class Progress:
    """How far POV-Ray is."""

    phase: Phase = Phase.STARTING
    fraction: float = 0.0
    """From 0 to 1; never falls."""
    count: int = 0
    """Thousands of tokens, photons or pixels of this phase; it moves while POV-Ray works."""
    radiosity: bool = False
    photons: bool = False


def is_progress(line: str) -> bool:
    """Tell whether a line says nothing but how far POV-Ray is."""
    return any(pattern.match(line) for pattern in (_RENDERED, _PARSING, _PHOTONS))


def advance(progress: Progress, line: str, *, first_block_px: int) -> Progress:
    """Return the progress after one more line.

    >>> advance(Progress(), "Rendered 1024 of 4096 pixels (25%)", first_block_px=1024).fraction
    0.25
    """
    if match := _RENDERED.match(line):
        return _rendered(progress, int(match[1]), int(match[2]), first_block_px)
    if match := _PARSING.match(line):
        return replace(progress, phase=Phase.PARSING, count=int(match[1]))
    if match := _PHOTONS.match(line):
        return replace(progress, phase=Phase.PHOTONS, count=int(match[1]), photons=True)
    if line.startswith("==== [Parsing..."):
        return replace(progress, phase=Phase.PARSING)
    if line.startswith("==== [Rendering..."):
        return replace(progress, phase=Phase.RENDERING, count=0)
    if _RADIOSITY_TIME.match(line):
        return replace(progress, radiosity=True)
    if _PHOTON_TIME.match(line):
        return replace(progress, photons=True)
    return progress


def _rendered(progress: Progress, done_px: int, total_px: int, first_block_px: int) -> Progress:
    phase = progress.phase
    first = phase is not Phase.PRETRACE and (phase is not Phase.RENDERING or progress.count == 0)
    if first:
        # A pretrace looks at a few pixels of each block only.
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


class Lines:
    r"""Bytes that come in any pieces become lines, split at \r and \n."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[str]:
        """Return the lines that these bytes complete."""
        *whole, self._rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        if len(self._rest) > MAX_LINE_BYTES:
            whole.append(self._rest)
            self._rest = b""
        return [line[:MAX_LINE_BYTES].decode(errors="replace") for line in whole]

    def close(self) -> list[str]:
        """Return what is left."""
        return self.feed(b"\n") if self._rest else []
