"""The lines of a .zmx file, by their words, and their numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NoReturn

from lippmann.optics.lens_files.lines import Line, wrong
from lippmann.untrusted.text_lines import read_lines


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

    def number(self, word: str) -> float:
        """Return the number behind a word; 0 without such a line."""
        line = self.first(word)
        return 0.0 if line is None else line.value()

    def distance(self, *, otherwise: float = 0.0) -> float:
        """Return the distance to the next surface, which is infinite for a distant object.

        Parameters
        ----------
        otherwise
            The distance to return without such a line.
        """
        line = self.first("DISZ")
        return otherwise if line is None else line.distance()

    def numbers(self, word: str) -> list[float]:
        """Return the numbers behind a word, up to the first other word."""
        line = self.first(word)
        return [] if line is None else line.leading_numbers()

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
        raise wrong(f"{self.place}, {word}", expected, "nothing")


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
