"""Frame ranges: parse text as `1-48:2, 60` into frame numbers, and format frame numbers as text."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Annotated

from pydantic import AfterValidator, Field

from lippmann.errors import SpecError

MAX_FRAMES = 300_000
"""The greatest number of frames of a job (2.8 hours at 30 frames a second)."""

MAX_FRAME_NUMBER = 999_999

_PART = re.compile(r"(?P<first>\d+)(?:-(?P<last>\d+)(?::(?P<step>\d+))?)?")


def parse_frames(text: str) -> tuple[int, ...]:
    """Return the frame numbers that `text` names, in rising order, each once.

    Parameters
    ----------
    text
        Comma-separated parts: a number `60`, a range `1-48`, or a range with a step `1-48:2`. Numbers start at 1.

    Raises
    ------
    SpecError
        If a part is not of that form, counts down, steps by zero, starts below 1, or the whole is empty or too long.

    Examples
    --------
    >>> parse_frames("1-6:2, 60")
    (1, 3, 5, 60)
    """
    numbers: set[int] = set()
    for part in text.split(","):
        frames = _parse_part(part.strip(), text)
        if len(frames) <= MAX_FRAMES:
            numbers.update(frames)
        if max(len(frames), len(numbers)) > MAX_FRAMES:
            raise SpecError(f"expected at most {MAX_FRAMES} frames, got more from {text!r}")
    return tuple(sorted(numbers))


def format_frames(numbers: Iterable[int]) -> str:
    """Return the shortest usual text for frame numbers; the inverse of `parse_frames`.

    Examples
    --------
    >>> format_frames((1, 2, 3, 7, 60))
    '1-3, 7, 60'
    """
    runs: list[list[int]] = []
    for number in sorted(set(numbers)):
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in runs)


def _parse_part(part: str, whole: str) -> range:
    match = _PART.fullmatch(part)
    if match is None:
        raise SpecError(f"expected frames like '1-48:2, 60', got {part!r} in {whole!r}")
    first = int(match["first"])
    last = int(match["last"] or first)
    step = int(match["step"] or 1)
    if first < 1 or last > MAX_FRAME_NUMBER:
        raise SpecError(f"expected frame numbers from 1 to {MAX_FRAME_NUMBER}, got {part!r} in {whole!r}")
    if last < first:
        raise SpecError(f"expected a range that counts up, got {part!r} in {whole!r}")
    if step < 1:
        raise SpecError(f"expected a step of 1 or more, got {part!r} in {whole!r}")
    return range(first, last + 1, step)


def _checked(text: str) -> str:
    try:
        parse_frames(text)
    except SpecError as error:
        raise ValueError(error.message.removeprefix("expected ").partition(", got ")[0]) from error
    return text


FrameList = Annotated[str, Field(max_length=1000), AfterValidator(_checked)]
"""The frames of a job, as text for `parse_frames`."""
