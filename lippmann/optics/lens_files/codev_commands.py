"""The commands of a CODE V sequence file: `;` and line ends separate them, `!` begins a comment, `&` joins lines."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NoReturn

from lippmann.errors import FieldProblem, SpecError
from lippmann.untrusted.shown import shown
from lippmann.untrusted.text_lines import read_lines

QUOTES = "'\""
MAX_WORDS = 2000
"""The greatest number of words of one command."""


@dataclass(frozen=True)
class Command:
    """A command: the number of its line, its name in capital letters, and its arguments."""

    number: int
    name: str
    values: tuple[str, ...]

    @property
    def place(self) -> str:
        """The words that name the command in a message."""
        return f"line {self.number}, {self.name}"

    def refuse(self, expected: str, got: str | None = None) -> NoReturn:
        """Raise the error that names the command.

        Parameters
        ----------
        expected
            What was expected.
        got
            What came; by default the words behind the name.
        """
        given = shown(" ".join(self.values)).strip(QUOTES) if got is None else got
        raise SpecError.of([FieldProblem(field=self.place, expected=expected, got=given or "nothing")])

    def value(self, place: int = 0) -> float:
        """Return the number at a place behind the name; it may be infinite only as a distance."""
        try:
            value = float(self.values[place])
        except (IndexError, ValueError):
            self.refuse("a number")
        if math.isnan(value):
            self.refuse("a number")
        return value

    def finite(self, place: int = 0) -> float:
        """Return the finite number at a place behind the name."""
        value = self.value(place)
        if math.isinf(value):
            self.refuse("a finite number")
        return value

    def numbers(self) -> list[float]:
        """Return all arguments as finite numbers."""
        return [self.finite(place) for place in range(len(self.values))]


def read_commands(text: str) -> Iterator[Command]:
    r"""Yield the commands of a sequence file.

    Parameters
    ----------
    text
        The content of the file.

    Raises
    ------
    InvalidText
        If the text has too many lines, or too long ones.
    SpecError
        If a command has too many words.

    Examples
    --------
    >>> [(one.number, one.name, one.values) for one in read_commands("EPD 5; S 50 & ! front\n 3 BK7\nTIT 'a; b'")]
    [(1, 'EPD', ('5',)), (1, 'S', ('50', '3', 'BK7')), (3, 'TIT', ('a; b',))]
    """
    words: list[str] = []
    start = 0
    for number, line in read_lines(text):
        is_continued = False
        for word in _words(line):
            if word == ";":
                yield from _command(start, words)
                words = []
                continue
            if word == "&":
                is_continued = True
                break
            start = number if not words else start
            words.append(word)
            if len(words) > MAX_WORDS:
                expected = f"at most {MAX_WORDS:,} words in a command"
                raise SpecError.of([FieldProblem(field=f"line {number}", expected=expected, got="more")])
        if not is_continued:
            yield from _command(start, words)
            words = []
    yield from _command(start, words)


def _command(number: int, words: list[str]) -> Iterator[Command]:
    if words:
        name = words[0].upper()[:40]
        # Three letters make a command; more are the same one (TITLE, STOP).
        yield Command(number, name[:3] if name.isalpha() else name, tuple(word.strip(QUOTES) for word in words[1:]))


def _words(line: str) -> Iterator[str]:
    """Yield the words of a line; `;` and `&` are words of their own, and a quoted text is one word."""
    word, quote = "", ""
    for letter in line:
        if quote:
            word += letter
            quote = "" if letter == quote else quote
        elif letter in QUOTES and not word:
            word = quote = letter
        elif letter == "!":
            break
        elif letter in ";&" or letter.isspace():
            if word:
                yield word
            word = ""
            if not letter.isspace():
                yield letter
        else:
            word += letter
    if word:
        yield word
