"""The variables of POV-Ray that a scene reads and that no parameter of a job decides: the clock and the time of day.

POV-Ray gives a scene no number of the frame: `frame_number` and its kind are 0, because the clock is set by `+K`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

_COMMENT = re.compile(rb"//[^\r\n]*|/\*.*?\*/", re.DOTALL)
_CLOCK = re.compile(rb"\bclock\b")
_NOW = re.compile(rb"\bnow\b")
_HEAD_BYTES = 8192
_NO_SDL = frozenset({".toml", ".md", ".html", ".json", ".py"})
"""The suffixes of text in other languages, such as that of the manifest, which names the clock."""


@dataclass(frozen=True)
class SceneVariables:
    """The variables that the files of a scene name outside comments; a scene that names one nowhere cannot read it."""

    clock: bool
    """True if the scene may read `clock`, so that frames at different clocks may differ."""
    now: bool
    """True if the scene may read `now`, the time of day, so that two renders of the same frame may differ."""


@lru_cache(maxsize=64)
def scene_variables(bundle: Path) -> SceneVariables:
    """Return which variables a scene may read; `bundle` is a folder that never changes.

    Every file counts that may be SDL.
    """
    has_clock = has_now = False
    for data in texts(bundle):
        if b"clock" in data or b"now" in data:
            code = _COMMENT.sub(_without_comment, data)
            has_clock |= _CLOCK.search(code) is not None
            has_now |= _NOW.search(code) is not None
    return SceneVariables(clock=has_clock, now=has_now)


def texts(bundle: Path) -> Iterator[bytes]:
    """Yield the files of a bundle that may be SDL: POV-Ray includes files of any name. A picture has a zero soon."""
    for path in filter(Path.is_file, bundle.rglob("*")):
        data = b"" if path.suffix.lower() in _NO_SDL else path.read_bytes()
        if b"\0" not in data[:_HEAD_BYTES]:
            yield data


def _without_comment(found: re.Match[bytes]) -> bytes:
    """Return what counts of something that looks like a comment: all of it if it may begin inside a string."""
    return found[0] if b'"' in found[0] else b" "
