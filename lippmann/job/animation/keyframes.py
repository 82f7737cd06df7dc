"""Keyframes: numbers of a job that change from frame to frame.

A job may have `{"keyframes": [[1, 60], [4, -10]]}` in place of any number of its rig, its stage or its scene
parameters. `lift` removes the keyframes from a job's JSON and leaves their first values; `put` sets the value at a
path.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from lippmann.job.fields.model import JobModel, at_most

ANIMATED_PARTS = ("rig", "stage", "parameters")
"""The parts of a job whose numbers may change with the frame."""

MAX_FRAME_NUMBER = 999_999
MAX_KEYS = 1000
"""The largest number of keyframes in a job."""
MAX_VALUE = 1e15
MAX_DEPTH = 20
"""The greatest depth in a job's JSON at which keyframes are searched; every number of a job is less deep."""

Key = tuple[Annotated[int, Field(ge=1, le=MAX_FRAME_NUMBER)], Annotated[float, Field(ge=-MAX_VALUE, le=MAX_VALUE)]]
"""A frame number, and the value at that frame."""


class Keyframes(JobModel):
    """A number that changes from frame to frame; it is constant before the first keyframe and after the last."""

    keyframes: Annotated[tuple[Key, ...], Field(min_length=1, max_length=MAX_KEYS), at_most(MAX_KEYS)]
    """The keyframes as (frame, value), in ascending order of the frames."""
    interpolation: Literal["linear", "smooth"] = "linear"
    """The interpolation between keyframes: `linear`, or `smooth`, a monotone cubic with a continuous slope."""

    @field_validator("keyframes")
    @classmethod
    def _check_ascending(cls, keys: tuple[Key, ...]) -> tuple[Key, ...]:
        for (before, _), (after, _) in pairwise(keys):
            if after <= before:
                raise ValueError(f"frames that rise, got frame {after} after frame {before}")
        return keys

    def at(self, frame: int) -> float:
        """Return the value at a frame.

        >>> Keyframes(keyframes=((1, 60.0), (3, 40.0))).at(2)
        50.0
        """
        keys = self.keyframes
        after = bisect_right(keys, frame, key=lambda key: key[0])
        if after == 0:
            return keys[0][1]
        if after == len(keys):
            return keys[-1][1]
        (begin, low), (end, high) = keys[after - 1], keys[after]
        part = (frame - begin) / (end - begin)
        if self.interpolation == "linear":
            return (1 - part) * low + part * high
        return _cubic(keys, after - 1, part)


def _cubic(keys: Sequence[Key], left: int, part: float) -> float:
    """Return the monotone cubic of Fritsch and Carlson (SIAM J. Numer. Anal. 17, 238 (1980)) between two keys."""
    (begin, low), (end, high) = keys[left], keys[left + 1]
    slope_left, slope_right = ((end - begin) * _slope(keys, key) for key in (left, left + 1))
    rest = 1.0 - part
    return (
        low * (1 + 2 * part) * rest**2
        + high * part**2 * (3 - 2 * part)
        + slope_left * part * rest**2
        - slope_right * part**2 * rest
    )


def _slope(keys: Sequence[Key], key: int) -> float:
    """Return the slope at a key: 0 at ends and turning points, else the weighted harmonic mean of the adjacent slopes.

    Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 300 (1984).
    """
    if key in (0, len(keys) - 1):
        return 0.0
    before, after = keys[key][0] - keys[key - 1][0], keys[key + 1][0] - keys[key][0]
    rise_before = (keys[key][1] - keys[key - 1][1]) / before
    rise_after = (keys[key + 1][1] - keys[key][1]) / after
    if rise_before * rise_after <= 0:
        return 0.0
    weight_before, weight_after = 2 * after + before, after + 2 * before
    return (weight_before + weight_after) / (weight_before / rise_before + weight_after / rise_after)


def lift(job: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a job's JSON with the first value in place of each list of keyframes, and the keyframes by path.

    >>> lift({"rig": {"lens_array": {"offset_mm": {"keyframes": [[1, 60], [2, 40]]}}}})
    ({'rig': {'lens_array': {'offset_mm': 60}}}, {'rig.lens_array.offset_mm': {'keyframes': [[1, 60], [2, 40]]}})
    """
    found: dict[str, Any] = {}
    parts = {name: _lifted(value, name, found, 1) if name in ANIMATED_PARTS else value for name, value in job.items()}
    return parts, found


def _lifted(value: Any, path: str, found: dict[str, Any], depth: int) -> Any:
    if depth > MAX_DEPTH:
        return value
    if isinstance(value, Mapping):
        if "keyframes" in value:
            found[path] = value
            return _first_of(value["keyframes"])
        return {name: _lifted(inner, f"{path}.{name}", found, depth + 1) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_lifted(inner, f"{path}.{number}", found, depth + 1) for number, inner in enumerate(value)]
    return value


def _first_of(keys: Any) -> Any:
    """Return the first value; the validation of the keyframes themselves refuses invalid ones."""
    try:
        return keys[0][1]
    except (TypeError, IndexError, KeyError):
        return 1.0


def put(job: dict[str, Any], path: str, value: float) -> Any:
    """Set the number at a path in a job's JSON, and return the previous value.

    Raises
    ------
    KeyError
        If the path does not exist.
    """
    *above, last = path.split(".")
    place: Any = job
    for name in above:
        place = _inner(place, name)
    before = _inner(place, last)
    place[_index(place, last)] = value
    return before


def _inner(place: Any, name: str) -> Any:
    try:
        return place[_index(place, name)]
    except (IndexError, TypeError) as error:
        raise KeyError(name) from error


def _index(place: Any, name: str) -> str | int:
    if not isinstance(place, list):
        return name
    if not (name.isascii() and name.isdigit() and len(name) < 5):
        raise KeyError(name)
    return int(name)
