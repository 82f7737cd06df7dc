"""Names that this release changed, in job files and in the environment.

The old names are accepted for one release, with a note that names the new one. A job that an earlier release stored is
read in the same way, so the tables also keep old data folders working.
"""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping, Sequence
from typing import Any

SETTINGS: Mapping[str, str] = {
    "LIPPMANN_CLERK": "LIPPMANN_COORDINATOR",
    "LIPPMANN_REST_S": "LIPPMANN_DEFERRAL_S",
}
"""The new name of every renamed environment variable, by its old name."""

JOB_FIELDS: Mapping[str, str] = {}
"""The new name of every renamed field of a job, by its old path: `rig.old_name`, or `outputs.*.old_name` in a list."""

JOB_VALUES: Mapping[str, Mapping[str, str]] = {"capture.method": {"raytraced": "glass"}}
"""The new form of every renamed value of a job, by the path of its field (as it is now) and by its old form."""


def rename_settings(environment: MutableMapping[str, str]) -> tuple[str, ...]:
    """Rename the old variables of an environment in place; return a note for each of them.

    A variable that is set under both names keeps the value of the new one, and the note says so.
    """
    notes = []
    for old, new in SETTINGS.items():
        if old not in environment:
            continue
        value = environment.pop(old)
        if not environment.get(new):  # An empty variable counts as one that is not set.
            environment[new] = value
        is_ignored = environment[new] != value
        notes.append(f"{_note(old, new)}; {new} is set too, so {old} is ignored" if is_ignored else _note(old, new))
    return tuple(notes)


def current_job(data: Any) -> tuple[Any, tuple[str, ...]]:
    """Return the JSON of a job under its current names, and a note for every old name.

    >>> current_job({"scene": "fish", "capture": {"method": "raytraced"}})[0]
    {'scene': 'fish', 'capture': {'method': 'glass'}}
    """
    notes: list[str] = []
    for path, new in JOB_FIELDS.items():
        data = _changed(data, path.split("."), _RenamedField(path, new, notes))
    for path, values in JOB_VALUES.items():
        data = _changed(data, path.split("."), _RenamedValue(path, values, notes))
    return data, tuple(notes)


class _RenamedField:
    """Renames one key of an object."""

    def __init__(self, path: str, new: str, notes: list[str]) -> None:
        self._path, self._new, self._notes = path, new, notes

    def __call__(self, part: Mapping[str, Any], name: str) -> dict[str, Any]:
        if self._new in part:  # Both names are given, and the validation refuses the old one.
            return dict(part)
        self._notes.append(_note(self._path, f"{self._path.rpartition('.')[0]}.{self._new}".lstrip(".")))
        return {self._new if key == name else key: value for key, value in part.items()}


class _RenamedValue:
    """Replaces one value of an object."""

    def __init__(self, path: str, values: Mapping[str, str], notes: list[str]) -> None:
        self._path, self._values, self._notes = path, values, notes

    def __call__(self, part: Mapping[str, Any], name: str) -> dict[str, Any]:
        old = part[name]
        if not isinstance(old, str) or old not in self._values:
            return dict(part)
        self._notes.append(_note(f"{self._path} {old}", self._values[old]))
        return {**part, name: self._values[old]}


def _changed(data: Any, path: Sequence[str], change: _RenamedField | _RenamedValue) -> Any:
    """Return data with a change at a path, where that path exists; the data itself is not modified."""
    name, *below = path
    if name == "*" and isinstance(data, list | tuple):
        return [_changed(item, below, change) for item in data]
    if not isinstance(data, Mapping) or name not in data:
        return data
    if not below:
        return change(data, name)
    return {**data, name: _changed(data[name], below, change)}


def _note(old: str, new: str) -> str:
    return f"{old} is now {new}; the next release refuses the old name"
