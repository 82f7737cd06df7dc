"""Python values as SDL text."""

from __future__ import annotations

import math
from collections.abc import Iterable


def number(value: float) -> str:
    """Return a number with all its digits.

    >>> number(1.0), number(-0.1), number(1e-7)
    ('1', '-0.1', '1e-07')

    Raises
    ------
    ValueError
        If the number is not finite, because SDL has no literal for it.
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
    """Return numbers separated by commas, as arguments of a macro."""
    return ", ".join(map(number, values))


def file_name(name: str) -> str:
    """Return the name by which a frame includes a scene: its own, or that of a link if POV-Ray could not read it.

    POV-Ray reads a blank in place of each byte outside ASCII, so that two names may become one.

    >>> file_name("fish.pov"), file_name("Würfel.pov")
    ('fish.pov', 'lippmann-scene.pov')
    """
    return name if name.isascii() else f"lippmann-scene{'.pov' if name.lower().endswith('.pov') else '.inc'}"


def switch(value: bool) -> str:
    """Return a boolean.

    >>> switch(True)
    'yes'
    """
    return "yes" if value else "no"


def colour(linear: Iterable[float]) -> str:
    """Return a colour in linear light. `srgb <...>` cannot be parsed before the scene has set assumed_gamma.

    >>> colour((1, 0, 0.25))
    'rgb <1, 0, 0.25>'
    """
    return f"rgb {vector(linear)}"
