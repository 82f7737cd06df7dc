"""The .ini beside a scene: the options of POV-Ray that a scene.toml has too, of the animation and the library path."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from typing import Any

from lippmann.job.animation.frames import MAX_FRAME_NUMBER

_MAX_BYTES = 64 * 1024
_SECTION = re.compile(r"\s*\[")
_OPTION = re.compile(r"\s*([A-Za-z_]+)\s*=\s*(.*)")
_WORD = re.compile(r'(?:"[^"]*"|\S)+')
_SWITCH = re.compile(r"([+-])(KFI|KFF|KI|KF|KC|K|I|L)(.*)", re.IGNORECASE)
_SWITCHES: Mapping[str, str] = {
    "KFI": "initial_frame",
    "KFF": "final_frame",
    "KI": "initial_clock",
    "KF": "final_clock",
    "KC": "cyclic_animation",
    "K": "clock",
    "I": "input_file_name",
    "L": "library_path",
}
_TRUE = frozenset({"on", "yes", "true", "1"})
_LARGEST = 1e9
_INCLUDES = re.compile(r"\binclude[/\\]*$", re.IGNORECASE)
"""The end of the folder of POV-Ray's own includes, on any system."""


@dataclass(frozen=True)
class AnimationIni:
    """The options of an .ini that concern a scene."""

    name: str
    """The name of the file."""
    clock: Mapping[str, Any]
    """The table `clock` of a scene.toml: the fields that the .ini sets."""
    include: tuple[str, ...]
    """The folders beside the scene on the library path."""
    notes: tuple[str, ...]
    """The settings of the .ini that are not in these fields."""


def animation_ini(scene: Path) -> AnimationIni | None:
    """Return the options of the .ini that starts a scene, or else of the one of the same name; None without one.

    An .ini that starts another scene does not count.
    """
    found = {path: list(_options(path)) for path in sorted(scene.parent.iterdir()) if _is_ini(path)}
    starts = {path: PureWindowsPath(dict(options).get("input_file_name", "")).name for path, options in found.items()}
    for path, options in found.items():
        if starts[path].lower() in (scene.name.lower(), scene.stem.lower()):
            return _read(path, options)
    for path, options in found.items():
        if not starts[path] and path.stem.lower() == scene.stem.lower():
            return _read(path, options)
    return None


def _is_ini(path: Path) -> bool:
    return path.suffix.lower() == ".ini" and path.is_file() and path.stat().st_size <= _MAX_BYTES


def _options(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the options before the first section, their names in lower case, and a switch by the name of its option."""
    for line in path.read_text(encoding="utf-8-sig", errors="replace").splitlines():
        text = line.partition(";")[0].strip()
        if _SECTION.match(text):
            return
        if option := _OPTION.fullmatch(text):
            yield option[1].lower(), option[2].strip("\"' ")
        else:
            for switch in filter(None, map(_SWITCH.fullmatch, _WORD.findall(text))):
                yield _SWITCHES[switch[2].upper()], switch[3].strip('"') or ("on" if switch[1] == "+" else "off")


def _read(path: Path, options: list[tuple[str, str]]) -> AnimationIni:
    named = dict(options)
    clock, notes = _clock(path.name, named)
    include = []
    for name, value in options:
        if name == "declare":
            notes.append(f"{path.name} declares {value}: make it a parameter of the scene (docs/scenes.md)")
        if name == "library_path" and (folder := _beside(path.parent, value)):
            include.append(folder)
        elif name == "library_path" and _INCLUDES.search(value) is None:
            notes.append(f"{path.name} names the folder {value!r}, which is not beside the scene")
    return AnimationIni(path.name, clock, tuple(dict.fromkeys(include)), tuple(notes))


def _clock(ini: str, named: Mapping[str, str]) -> tuple[dict[str, Any], list[str]]:
    """Return the table `clock` for the options of an .ini, and notes."""
    still = _number(named, "clock", 0.0)
    initial, final = (_number(named, f"{end}_frame", 1.0) for end in ("initial", "final"))
    frames = int(final) - int(initial) + 1
    if not 2 <= frames <= MAX_FRAME_NUMBER:
        return {"first": still} if still else {}, []
    moved = f"frame {initial:g} of {ini} is frame 1 of a job, and frame_number counts from 1"
    clock = {
        "first": _number(named, "initial_clock", 0.0),
        "last": _number(named, "final_clock", 1.0),
        "frames": frames,
        "cyclic": named.get("cyclic_animation", "off").lower() in _TRUE,
    }
    return clock, [] if initial == 1 else [moved]


def _number(named: Mapping[str, str], name: str, default: float) -> float:
    try:
        number = float(named.get(name, default))
    except ValueError:
        return default
    return number if abs(number) < _LARGEST else default


def _beside(folder: Path, named: str) -> str:
    """Return a folder of the library path relative to the scene, or nothing if it is not below it."""
    path = folder / named.replace("\\", "/")
    if not path.is_dir() or not path.resolve().is_relative_to(folder.resolve()):
        return ""
    found = path.resolve().relative_to(folder.resolve()).as_posix()
    return found if found != "." and found.isascii() and chr(34) not in found else ""
