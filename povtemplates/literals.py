"""Python values as SDL text."""

from __future__ import annotations

import math
from collections.abc import Iterable


def number(value: float) -> str:
    """Return a number, all its digits.

    >>> number(1.0), number(-0.1), number(1e-7)
    ('1', '-0.1', '1e-07')

    Raises
    ------
    ValueError
        If it is not finite: SDL has no word for that.
    """
    if not math.isfinite(value):
        raise ValueError(f"expected a finite number, got {value}")
    return repr(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(float(value))


def vector(values: Iterable[float]) -> str:
    """Return a vector.

    >>> vector((0, 60.5, -1000))
    '<0, 60.5, -1000>'
    """
    return f"<{numbers(values)}>"


def numbers(values: Iterable[float]) -> str:
    """Return numbers separated by commas, as a macro's arguments."""
    return ", ".join(map(number, values))


def parameter(value: bool | int | float | str) -> str:
    """Return a scene parameter: a number, a switch or a colour written '#rrggbb' in sRGB.

    >>> parameter(True), parameter("#ff0080")
    ('yes', 'srgb <1, 0, 0.5019607843137255>')
    """
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return "srgb " + vector(int(value[start : start + 2], 16) / 255 for start in (1, 3, 5))
    return number(value)
