"""Numbers as functions of the frame: keyframes, and how they are found in a job and put back as constants.

A job may say `{"keyframes": [[1, 60], [4, -10]]}` wherever its rig, its stage or its scene's parameters have a number.
`lift` takes these out of a job's JSON and leaves the first value; `put` sets one value by its path.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

ANIMATED_PARTS = ("rig", "stage", "parameters")
"""The parts of a job whose numbers may change with the frame."""

Key = tuple[Annotated[int, Field(ge=1)], float]
"""A frame and the value there."""


class Keyframes(BaseModel):
    """A number that changes with the frame; before the first key and after the last it stays."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    keyframes: Annotated[tuple[Key, ...], Field(min_length=1, max_length=10_000)]
    """(frame, value), frames rising."""
    interpolation: Literal["linear", "smooth"] = "linear"
    """`smooth`: a cubic without overshoot, its slope continuous."""

    @field_validator("keyframes")
    @classmethod
    def _rise(cls, keys: tuple[Key, ...]) -> tuple[Key, ...]:
        for (before, _), (after, _) in pairwise(keys):
            if after <= before:
                raise ValueError(f"frames that rise, got frame {after} after frame {before}")
        return keys

    def at(self, frame: int) -> float:
        """Return the value at a frame.

        >>> Keyframes(keyframes=((1, 60.0), (3, 40.0))).at(2)
        50.0
        """
        frames = [key[0] for key in self.keyframes]
        values = [key[1] for key in self.keyframes]
        after = bisect_right(frames, frame)
        if after == 0:
            return values[0]
        if after == len(frames):
            return values[-1]
        part = (frame - frames[after - 1]) / (frames[after] - frames[after - 1])
        if self.interpolation == "linear":
            return values[after - 1] + part * (values[after] - values[after - 1])
        return _cubic(frames, values, after - 1, part)


def _cubic(frames: Sequence[int], values: Sequence[float], left: int, part: float) -> float:
    """Return the monotone cubic of Fritsch and Carlson (SIAM J. Numer. Anal. 17, 238 (1980)) between two keys."""
    width = frames[left + 1] - frames[left]
    begin, end = (width * _slope(frames, values, key) for key in (left, left + 1))
    rest = 1.0 - part
    return (
        values[left] * (1 + 2 * part) * rest**2
        + values[left + 1] * part**2 * (3 - 2 * part)
        + begin * part * rest**2
        - end * part**2 * rest
    )


def _slope(frames: Sequence[int], values: Sequence[float], key: int) -> float:
    """Return the slope at a key: none at ends and turning points, else the weighted harmonic mean of its neighbours.

    Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 300 (1984).
    """
    if key in (0, len(frames) - 1):
        return 0.0
    before, after = frames[key] - frames[key - 1], frames[key + 1] - frames[key]
    rise_before = (values[key] - values[key - 1]) / before
    rise_after = (values[key + 1] - values[key]) / after
    if rise_before * rise_after <= 0:
        return 0.0
    weight_before, weight_after = 2 * after + before, after + 2 * before
    return (weight_before + weight_after) / (weight_before / rise_before + weight_after / rise_after)


def lift(job: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a job's JSON with the first value in place of every list of keyframes, and these by path.

    >>> lift({"rig": {"lens_array": {"offset_mm": {"keyframes": [[1, 60], [2, 40]]}}}})
    ({'rig': {'lens_array': {'offset_mm': 60}}}, {'rig.lens_array.offset_mm': {'keyframes': [[1, 60], [2, 40]]}})
    """
    found: dict[str, Any] = {}
    parts = {name: _lifted(value, name, found) if name in ANIMATED_PARTS else value for name, value in job.items()}
    return parts, found


def _lifted(value: Any, path: str, found: dict[str, Any]) -> Any:
    if isinstance(value, Mapping):
        if "keyframes" in value:
            found[path] = value
            return _first_of(value["keyframes"])
        return {name: _lifted(inner, f"{path}.{name}", found) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_lifted(inner, f"{path}.{number}", found) for number, inner in enumerate(value)]
    return value


def _first_of(keys: Any) -> Any:
    """Return the first value; what cannot be read is refused when the keyframes themselves are checked."""
    try:
        return keys[0][1]
    except (TypeError, IndexError, KeyError):
        return 1.0


def put(job: dict[str, Any], path: str, value: float) -> None:
    """Set a number in a job's JSON.

    Raises
    ------
    KeyError
        If there is no such place.
    """
    *above, last = path.split(".")
    place: Any = job
    for name in above:
        place = place[int(name)] if isinstance(place, list) else place[name]
        if not isinstance(place, dict | list):
            raise KeyError(path)
    if isinstance(place, list):
        place[int(last)] = value
    else:
        place[last] = value
