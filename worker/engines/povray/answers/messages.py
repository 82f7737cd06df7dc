"""POV-Ray's messages, read: errors and warnings with file and line, and the statistics at the end.

POV-Ray wraps at 80 columns. A message continues in the next line if that begins with a space, or if the last
line is full, because a word that is too long for a line is cut.

A scene can print any text of any length. So a message is cut at `LONGEST_MESSAGE`, a number of too many digits is text,
and the times are no longer than those that the system measured.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

COLUMNS = 80
LONGEST_MESSAGE = 4000
"""The characters of a message after which its further lines are left out."""

_BEGINS = re.compile(r"File '|(?:Possible )?Parse (?:Error|Warning): |Fatal error in ")
_MESSAGE = re.compile(
    r"(?:File '(?P<file>.*?)' line (?P<line>\d{1,9}): )?"
    r"(?P<kind>Possible Parse Error|Parse Error|Parse Warning): (?P<text>.*)",
    re.ASCII,
)
_NUMBER = r"(\d{1,9}(?:\.\d{1,9})?)"
_SECONDS = re.compile(rf"\s*(Parse|Bounding|Photon|Radiosity|Trace) Time:.*\({_NUMBER} seconds\)", re.ASCII)
_CPU_SECONDS = re.compile(rf"\s+using \d+ thread\(s\) with {_NUMBER} CPU-seconds total", re.ASCII)


class MessageKind(StrEnum):
    """The severity of a message."""

    ERROR = "Parse Error"
    HINT = "Possible Parse Error"
    """A message before an error, with a detail that the error lacks."""
    WARNING = "Parse Warning"


@dataclass(frozen=True)
class Message:
    """One message about the scene."""

    kind: MessageKind
    text: str
    file: str | None = None
    line: int | None = None

    def __str__(self) -> str:
        return f"{self.file} line {self.line}: {self.text}" if self.file else self.text


@dataclass(frozen=True)
class Statistics:
    """The times that POV-Ray reports: elapsed seconds, and CPU seconds of all threads."""

    parse_s: float = 0.0
    """Elapsed seconds of parsing and bounding."""
    parse_cpu_s: float = 0.0
    trace_s: float = 0.0
    """Elapsed seconds of photons, radiosity and tracing."""
    trace_cpu_s: float = 0.0

    def at_most(self, *, wall_s: float, cpu_s: float) -> Statistics:
        """Return the times without what exceeds the measured ones: a scene can print any number of seconds.

        >>> Statistics(trace_s=9.0, trace_cpu_s=1e6).at_most(wall_s=4.0, cpu_s=3.5).trace_cpu_s
        3.5
        """
        return replace(
            self,
            parse_s=min(self.parse_s, wall_s),
            parse_cpu_s=min(self.parse_cpu_s, cpu_s),
            trace_s=min(self.trace_s, wall_s),
            trace_cpu_s=min(self.trace_cpu_s, cpu_s),
        )


def unwrap(lines: Iterable[str]) -> list[str]:
    """Return the lines with every wrapped message in one line.

    >>> unwrap(["Parse Error: No matching } in 'sphere', plane found", " instead"])
    ["Parse Error: No matching } in 'sphere', plane found instead"]
    """
    whole: list[str] = []
    last, inside = "", False
    for line in lines:
        begins = _BEGINS.match(line) is not None
        if inside and not begins and (line.startswith(" ") or len(last) >= COLUMNS):
            if len(whole[-1]) < LONGEST_MESSAGE:
                whole[-1] = (whole[-1] + line)[:LONGEST_MESSAGE]
        else:
            whole.append(line[:LONGEST_MESSAGE])
            inside = begins
        last = line
    return whole


def read_messages(lines: Iterable[str], *, roots: Sequence[Path] = ()) -> list[Message]:
    """Return the messages about the scene; paths are made relative to `roots`."""
    matches = (_MESSAGE.fullmatch(line) for line in unwrap(lines))
    return [
        Message(
            MessageKind(match["kind"]),
            relative(match["text"].strip(), roots),
            relative(match["file"], roots) if match["file"] else None,
            int(match["line"]) if match["line"] else None,
        )
        for match in matches
        if match
    ]


def relative(text: str, roots: Sequence[Path]) -> str:
    """Return `text` with paths made relative to `roots`, which only this machine has.

    >>> relative("/scratch/7/bundle/tex/skin.png", [Path("/scratch/7/bundle")])
    'tex/skin.png'
    """
    for root in sorted(roots, key=lambda path: -len(path.parts)):
        text = text.replace(f"{root}/", "")
    return text


def read_statistics(lines: Iterable[str]) -> Statistics | None:
    """Return the times that POV-Ray reports, or None if it ended before it reported them."""
    wall: dict[str, float] = {}
    cpu: dict[str, float] = {}
    part = None
    for line in lines:
        if match := _SECONDS.match(line):
            part = match[1]
            wall[part] = float(match[2])
        elif part and (match := _CPU_SECONDS.match(line)):
            cpu[part] = float(match[1])
    if "Trace" not in wall:
        return None
    parse, trace = ("Parse", "Bounding"), ("Photon", "Radiosity", "Trace")
    return Statistics(
        parse_s=_sum(wall, parse),
        parse_cpu_s=_sum(cpu, parse),
        trace_s=_sum(wall, trace),
        trace_cpu_s=_sum(cpu, trace),
    )


def _sum(seconds: dict[str, float], parts: tuple[str, ...]) -> float:
    return round(sum(seconds.get(part, 0.0) for part in parts), 3)
