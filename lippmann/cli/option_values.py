"""Parse options that hold several numbers: `--eye 0,20,400`, `--stack -10:10:5`, the lenses over a picture."""

from __future__ import annotations

import math

from lippmann.errors import BadInput, LayoutError
from lippmann.lattice.cell import Lattice
from lippmann.lattice.layout import CellLayout

MAX_DEPTHS = 1000
"""The longest stack; more depths come of a mistyped step."""


def numbers_of(text: str, separator: str, *, count: int, expected: str) -> tuple[float, ...]:
    """Parse finite numbers.

    Parameters
    ----------
    text
        The value of the option.
    separator
        What stands between two numbers.
    count
        How many numbers there must be.
    expected
        What the message of an error says was expected.

    Raises
    ------
    BadInput
        If these are not so many finite numbers.

    Examples
    --------
    >>> numbers_of("0,20,400", ",", count=3, expected="an eye as X,Y,Z in mm")
    (0.0, 20.0, 400.0)
    """
    try:
        numbers = tuple(map(float, text.split(separator)))
    except ValueError as error:
        raise BadInput(f"expected {expected}, got {text}") from error
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise BadInput(f"expected {expected}, got {text}")
    return numbers


def eye_of(text: str) -> tuple[float, float, float]:
    """Parse the place of an eye, "X,Y,Z": mm to the right, upward, and in front of the middle of the display."""
    x_mm, y_mm, distance_mm = numbers_of(text, ",", count=3, expected="an eye as X,Y,Z in mm")
    return x_mm, y_mm, distance_mm


def part_of(text: str) -> tuple[float, float, float, float]:
    """Parse a part of a display, "X,Y,W,H": its middle (right, up), width and height, mm."""
    right, up, wide, high = numbers_of(text, ",", count=4, expected="a part of the display as X,Y,W,H in mm")
    return right, up, wide, high


def range_of(text: str) -> tuple[float, float]:
    """Parse a range of depths, "FARTHEST:NEAREST", mm.

    Raises
    ------
    BadInput
        If these are not two rising numbers.
    """
    far, near = numbers_of(text, ":", count=2, expected="depths as A:B in mm")
    if not far < near:
        raise BadInput(f"expected depths as FARTHEST:NEAREST in mm, rising, got {far:g}:{near:g}")
    return far, near


def depths_of(text: str) -> tuple[float, ...]:
    """Parse the depths of a stack, "A:B:STEP", mm; B is among them where a step meets it.

    Raises
    ------
    BadInput
        If the depths do not rise, or there are more than `MAX_DEPTHS`.

    Examples
    --------
    >>> depths_of("-10:10:5")
    (-10.0, -5.0, 0.0, 5.0, 10.0)
    """
    first, last, step = numbers_of(text, ":", count=3, expected="depths as A:B:STEP in mm")
    if last < first or step < 0.01:
        raise BadInput(f"expected depths that count up by 0.01 mm or more, got {text}")
    count = math.floor((last - first) / step + 1e-9) + 1
    if count > MAX_DEPTHS:
        raise BadInput(f"expected at most {MAX_DEPTHS} depths, got {count} in {text}")
    return tuple(round(first + index * step, 6) for index in range(count))


def layout_of(
    px_per_lens: int | None, lens_count: tuple[int, int] | None, lattice: Lattice | None = None
) -> CellLayout | None:
    """Return the layout that --px-per-lens, --lens-count and --lattice describe; None if none of them is given.

    Raises
    ------
    BadInput
        If one of the first two is missing, or they describe no lattice.
    """
    options = {"--px-per-lens": px_per_lens, "--lens-count": lens_count, "--lattice": lattice}
    given = [option for option, value in options.items() if value is not None]
    if not given:
        return None
    if px_per_lens is None or lens_count is None:
        raise BadInput(f"expected both --px-per-lens and --lens-count, or neither, got only {' and '.join(given)}")
    try:
        return CellLayout(*lens_count, px_per_lens=px_per_lens, lattice=lattice or "square")
    except LayoutError as error:
        raise BadInput(f"--lens-count and --px-per-lens: {error.message}") from error
