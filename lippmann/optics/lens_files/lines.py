"""The numbered lines of lens design files: a word, the values behind it, and the error that names the line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NoReturn

from lippmann.errors import FieldProblem, SpecError
from lippmann.untrusted.shown import shown

QUOTES = "'\""


def wrong(place: str, expected: str, got: str) -> SpecError:
    """Return the error that names one place of a file.

    Parameters
    ----------
    place
        The words that name the place, for example `line 7, CURV`.
    expected
        What was expected.
    got
        What came.
    """
    return SpecError.of([FieldProblem(field=place, expected=expected, got=got)])


def finite_number(text: str) -> float | None:
    """Return the finite number that a text is; None for another text.

    Examples
    --------
    >>> finite_number("-2.5e-3"), finite_number("inf"), finite_number("F2")
    (-0.0025, None, None)
    """
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


@dataclass(frozen=True)
class Line:
    """A line or a command of a file: its number, its first word in capital letters, and the words behind it."""

    number: int
    word: str
    values: tuple[str, ...]

    @property
    def place(self) -> str:
        """The words that name the line in a message."""
        return f"line {self.number}, {self.word}"

    def refuse(self, expected: str, got: str | None = None) -> NoReturn:
        """Raise the error that names the line.

        Parameters
        ----------
        expected
            What was expected.
        got
            What came; by default the words behind the word.
        """
        given = shown(" ".join(self.values)).strip(QUOTES) if got is None else got
        raise wrong(self.place, expected, given or "nothing")

    def distance(self, place: int = 0) -> float:
        """Return the number at a place behind the word; it may be infinite, as the distance of an object."""
        value = self._number(place)
        if math.isnan(value):
            self.refuse("a number")
        return value

    def value(self, place: int = 0) -> float:
        """Return the finite number at a place behind the word."""
        value = self._number(place)
        if not math.isfinite(value):
            self.refuse("a finite number")
        return value

    def all_numbers(self) -> list[float]:
        """Return all words behind the word as finite numbers."""
        return [self.value(place) for place in range(len(self.values))]

    def leading_numbers(self) -> list[float]:
        """Return the numbers behind the word, up to the first other word; one that is not finite counts as 0."""
        found = []
        for text in self.values:
            try:
                value = float(text)
            except ValueError:
                break
            found.append(value if math.isfinite(value) else 0.0)
        return found

    def _number(self, place: int) -> float:
        try:
            return float(self.values[place])
        except (IndexError, ValueError):
            self.refuse("a number")
