"""Parse options that hold several numbers: `--frames 1-8`, `--eye 0,20,400`, `--stack -10:10:5`, `--lenses 115x100`."""

from __future__ import annotations

import math
import re
import warnings

from lippmann.errors import BadInput, LayoutError
from lippmann.job.animation.frames import parse_frames
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


def frames_of(text: str | None) -> tuple[int, ...] | None:
    """Parse the frames of `--frames`; None without the option, which an empty text is not: a variable may be empty."""
    if text is not None and not text.strip():
        raise BadInput(f"--frames: expected frames such as 1-48:2,60, got {text!r}")
    return None if text is None else parse_frames(text)


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


def count_of(
    text: str | None, old: tuple[int, int] | None = None, *, option: str = "--lenses", old_option: str = "--lens-count"
) -> tuple[int, int] | None:
    """Parse a number of lenses, "COLSxROWS", and return rows and columns as a job file has them; None without a text.

    Parameters
    ----------
    old
        Rows and columns, as the old name of the option takes them.

    Raises
    ------
    BadInput
        If these are not two whole numbers.

    Warns
    -----
    FutureWarning
        If the option has its old name.

    Examples
    --------
    >>> count_of("115x100")
    (100, 115)
    """
    if old is not None:
        rows, cols = old
        _warn_renamed(f"{old_option} {rows} {cols}", f"{option} {cols}x{rows}")
        return old
    if text is None:
        return None
    found = re.fullmatch(r"(\d{1,6})[x*](\d{1,6})", text.replace(" ", "").lower(), re.ASCII)
    if found is None:
        raise BadInput(f"{option}: expected lenses across and down as COLSxROWS, such as 115x100, got {text!r}")
    return int(found[2]), int(found[1])


def first_lens_of(text: str | None, old: str | None = None) -> tuple[float, float] | None:
    """Parse the place of the first lens, "RIGHT,DOWN" in px, and return px down and to the right; None without a text.

    Parameters
    ----------
    old
        The place as the old name of the option takes it, "DOWN,RIGHT".

    Raises
    ------
    BadInput
        If these are not two numbers.

    Warns
    -----
    FutureWarning
        If the option has its old name.

    Examples
    --------
    >>> first_lens_of("11.5,4")
    (4.0, 11.5)
    """
    if old is not None:
        down, right = numbers_of(old, ",", count=2, expected="--offset-px as DOWN,RIGHT in px")
        _warn_renamed(f"--offset-px {old}", f"--first-lens-px {right:g},{down:g}")
        return down, right
    if text is None:
        return None
    right, down = numbers_of(text, ",", count=2, expected="--first-lens-px as RIGHT,DOWN in px")
    return down, right


def layout_of(
    px_per_lens: int | None, lens_count: tuple[int, int] | None, lattice: Lattice | None = None
) -> CellLayout | None:
    """Return the layout that --px-per-lens, --lenses and --lattice describe; None if none of them is given.

    Raises
    ------
    BadInput
        If one of the first two is missing, or they describe no lattice.
    """
    options = {"--px-per-lens": px_per_lens, "--lenses": lens_count, "--lattice": lattice}
    given = [option for option, value in options.items() if value is not None]
    if not given:
        return None
    if px_per_lens is None or lens_count is None:
        raise BadInput(f"expected both --px-per-lens and --lenses, or neither, got only {' and '.join(given)}")
    try:
        return CellLayout(*lens_count, px_per_lens=px_per_lens, lattice=lattice or "square")
    except LayoutError as error:
        raise BadInput(f"--lenses and --px-per-lens: {error.message}") from error


def _warn_renamed(old: str, new: str) -> None:
    """Warn that an option with its value has another name now; the caller's caller is named."""
    warnings.warn(f"{old} is now {new}; the next release drops the old name", FutureWarning, stacklevel=3)
