"""The names in the files of a scene: clock, variables of an animation, time of day, chance, files that they write."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from lippmann.errors import ScratchDamaged
from worker.sandbox.bundle import listing_of

_COMMENT = re.compile(rb"//[^\r\n]*|/\*(?:.*?\*/|.*\Z)", re.DOTALL)
"""A comment, also one that is not closed: each byte is looked at once or twice, whatever the text."""
_CLOCK = re.compile(rb"\bclock\b")
_FRAMES = re.compile(rb"\b(?:frame_number|initial_frame|final_frame|initial_clock|final_clock|clock_delta|clock_on)\b")
_NOW = re.compile(rb"\bnow\b")
_WRITES = re.compile(rb"#\s*fopen\b[^#]{0,2000}?\b(?:write|append)\b|\bsave_file\b")
_CAMERA = re.compile(rb'\bcamera\b|(?i:\b(?:screen|stage1|stdcam)(?:\.inc)?")')
"""The word, or an include of POV-Ray that has a camera."""
_CHANCE = re.compile(
    rb"\b(?:crand|jitter|media|photons|radiosity|subsurface)\b"
    rb'|(?i:\b(?:rad_def|stage1|stoneold|stones[12]?|textures)(?:\.inc)?")'
)
"""Features that POV-Ray samples at random, each thread with numbers of its own, or an include that has one of them."""
_POV_FILE = re.compile(rb'\.pov"', re.IGNORECASE)
_BEFORE_NAME = re.compile(rb'["/\\\r\n]')
_LONGEST_NAME = 204
_WORDS = (b"#", b"clock", b"frame", b"now", b"save_file", b"camera", b"crand", b"jitter", b"media", b"photons",
          b"radiosity", b"subsurface")  # fmt: skip
"""One of these is in every file that counts; directives, such as #include and #fopen, begin with the first."""
_HEAD_BYTES = 8192
_SDL = frozenset({".pov", ".inc"})
_NO_SDL = frozenset({".toml", ".md", ".html", ".json", ".py"})
"""The suffixes of text in other languages, such as that of the manifest, which names the clock."""
_PROSE = frozenset({"authors", "changelog", "copying", "licence", "license", "notice", "readme"})
"""The names, without suffixes, of texts for people. What they name is not taken for code in a note."""


@dataclass(frozen=True)
class SceneVariables:
    """The variables that the files of a scene name outside comments; a scene that names one nowhere cannot read it."""

    clock: bool
    """True if the scene may read `clock`, so that frames at different clocks may differ."""
    now: bool
    """True if the scene may read `now`, the time of day, so that two renders of the same frame may differ."""
    frames: bool = False
    """True if the scene may read `frame_number` or another variable of an animation."""
    chance: bool = False
    """True if the scene may have something that POV-Ray samples at random, such as media: then two renders by several
    threads may differ."""
    writes: tuple[str, ...] = ()
    """The files of the bundle that may open a file for writing, sorted."""
    cameras: tuple[str, ...] = ()
    """The files of the bundle that may have a camera, sorted."""
    included: frozenset[str] = frozenset()
    """The names of .pov files, in lower case and without folders, that stand in the text of another file."""

    def has_camera(self, file: str) -> bool:
        """Return whether a scene may have a camera of its own: in its file, or in one that it may include.

        A .pov file that no other file names is another scene.
        """
        return any(
            name == file or not name.lower().endswith(".pov") or name.lower().rpartition("/")[2] in self.included
            for name in self.cameras
        )


def scene_variables(bundle: Path) -> SceneVariables:
    """Return which variables the scene in a folder may read.

    Every file counts that may be SDL.

    Raises
    ------
    ScratchDamaged
        If the files change meanwhile.
    """
    return _variables(bundle, listing_of(bundle))


@lru_cache(maxsize=64)
def _variables(bundle: Path, listing: str) -> SceneVariables:
    has_clock = has_now = has_frames = has_chance = False
    writes, cameras, included = [], [], set[str]()
    for path, data in texts(bundle):
        if not any(word in data for word in _WORDS):
            continue
        code = _COMMENT.sub(_without_comment, data)
        name = path.relative_to(bundle).as_posix()
        has_clock |= _CLOCK.search(code) is not None
        has_now |= _NOW.search(code) is not None
        has_frames |= _FRAMES.search(code) is not None
        has_chance |= _CHANCE.search(code) is not None
        included |= set(_pov_files(code))
        if path.stem.lower() in _PROSE:
            continue
        if _WRITES.search(code):
            writes.append(name)
        if _CAMERA.search(code):
            cameras.append(name)
    if listing_of(bundle) != listing:
        raise ScratchDamaged("files of the scene changed while they were read")
    return SceneVariables(
        clock=has_clock,
        now=has_now,
        frames=has_frames,
        chance=has_chance,
        writes=tuple(sorted(writes)),
        cameras=tuple(sorted(cameras)),
        included=frozenset(included),
    )


def _pov_files(code: bytes) -> Iterator[str]:
    """Yield the names of .pov files in quotation marks, in lower case and without folders."""
    for found in _POV_FILE.finditer(code):
        before = code[max(0, found.end() - 1 - _LONGEST_NAME) : found.end() - 1]
        yield _BEFORE_NAME.split(before)[-1].decode(errors="replace").lower()


def texts(bundle: Path) -> Iterator[tuple[Path, bytes]]:
    """Yield the files of a bundle that may be SDL, with their bytes: POV-Ray includes files of any name.

    A picture has a zero soon, and some editors write zeros at the end of a scene.
    """
    for path in filter(Path.is_file, bundle.rglob("*")):
        kind = path.suffix.lower()
        data = b"" if kind in _NO_SDL else path.read_bytes()
        if kind in _SDL or b"\0" not in data[:_HEAD_BYTES]:
            yield path, data


def _without_comment(found: re.Match[bytes]) -> bytes:
    """Return what counts of a seeming comment: all of it if it may begin inside a string or has no end."""
    is_open = found[0].startswith(b"/*") and not found[0].endswith(b"*/", 2)
    return found[0] if is_open or b'"' in found[0] else b" "
