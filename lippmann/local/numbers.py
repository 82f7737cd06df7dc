"""Numbers as options carry them: `0,20,400`."""

from __future__ import annotations

import math

from lippmann.errors import BadInput


def numbers_of(text: str, between: str, *, count: int, wanted: str) -> tuple[float, ...]:
    """Return so many finite numbers.

    Raises
    ------
    BadInput
        Saying what was wanted, if these are not.

    Examples
    --------
    >>> numbers_of("0,20,400", ",", count=3, wanted="an eye as X,Y,Z in mm")
    (0.0, 20.0, 400.0)
    """
    try:
        numbers = tuple(map(float, text.split(between)))
    except ValueError as error:
        raise BadInput(f"expected {wanted}, got {text}") from error
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise BadInput(f"expected {wanted}, got {text}")
    return numbers
