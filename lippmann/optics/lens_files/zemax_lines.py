"""The lines of a .zmx file, by their words, and their numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NoReturn

from lippmann.errors import FieldProblem, SpecError
from lippmann.untrusted.shown import shown
from lippmann.untrusted.text_lines import read_lines


@dataclass(frozen=True)
class Line:
    """A line: its number, its first word in capital letters, and the words behind it."""

    number: int
    word: str
    values: tuple[str, ...]

    def refuse(self, expected: str, got: str | None = None) -> NoReturn:
        """Raise the error that names the line.

        Parameters
        ----------
        expected
            What was expected.
        got
            What came; by default the words behind the word.
        """
        place = f"line {self.number}, {self.word}"
        given = shown(" ".join(self.values)).strip("'\"") if got is None else got
        raise SpecError.of([FieldProblem(field=place, expected=expected, got=given or "nothing")])

    def value(self, place: int = 0) -> float:
        """Return the number at a place behind the word."""
        try:
            value = float(self.values[place])
        except (IndexError, ValueError):
            self.refuse("a number")
        # An object or an image may lie at infinity.
        if math.isnan(value) or (math.isinf(value) and self.word != "DISZ"):
            self.refuse("a finite number")
        return value

    def numbers(self) -> list[float]:
        """Return the numbers behind the word, up to the first other word."""
        found = []
        for text in self.values:
            try:
                value = float(text)
            except ValueError:
                break
            found.append(value if math.isfinite(value) else 0.0)
        return found


@dataclass
class Block:
    """The lines of one SURF, or those before the first."""

    start: Line
    lines: list[Line] = field(default_factory=list)

    @property
    def place(self) -> str:
        """The words that name the surface in a message."""
        return f"line {self.start.number}, SURF {' '.join(self.start.values)}"

    def first(self, word: str) -> Line | None:
        """Return the first line with a word."""
        return next((line for line in self.lines if line.word == word), None)

    def number(self, word: str, *, otherwise: float = 0.0) -> float:
        """Return the number behind a word.

        Parameters
        ----------
        word
            The word.
        otherwise
            The number to return without such a line.
        """
        line = self.first(word)
        return otherwise if line is None else line.value()

    def numbers(self, word: str) -> list[float]:
        """Return the numbers behind a word."""
        line = self.first(word)
        return [] if line is None else line.numbers()

    def refuse(self, word: str, expected: str) -> NoReturn:
        """Raise the error that names the line of a word, or the block if the word is absent.

        Parameters
        ----------
        word
            The word.
        expected
            What was expected.
        """
        line = self.first(word)
        if line is not None:
            line.refuse(expected, line.values[0] if line.values else None)
        raise SpecError.of([FieldProblem(field=f"{self.place}, {word}", expected=expected, got="nothing")])


def read_blocks(text: str) -> tuple[Block, list[Block]]:
    """Return the lines before the first SURF, and the blocks of the surfaces.

    Parameters
    ----------
    text
        The content of the file.

    Raises
    ------
    InvalidText
        If the text has too many lines, or too long ones.
    SpecError
        If the file is not sequential.
    """
    head = Block(Line(1, "", ()))
    blocks: list[Block] = []
    for line in _lines(text):
        if line.word == "SURF":
            blocks.append(Block(line))
        elif line.word == "MODE" and line.values[:1] != ("SEQ",):
            line.refuse("SEQ: a sequential system")
        else:
            (blocks[-1] if blocks else head).lines.append(line)
    return head, blocks


def _lines(text: str) -> Iterator[Line]:
    for number, line in read_lines(text):
        word, *values = line.split() or [""]
        if word:
            yield Line(number, word.upper(), tuple(values))
