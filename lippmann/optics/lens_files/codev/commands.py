"""The commands of a CODE V sequence file: `;` and line ends separate them, `!` begins a comment, `&` joins lines."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from lippmann.optics.lens_files.lines import QUOTES, Line, wrong
from lippmann.untrusted.text_lines import read_lines

MAX_WORDS = 2000
"""The greatest number of words of one command."""
MAX_NAME = 40


@dataclass(frozen=True)
class Command(Line):
    """A command, whose word is its name in three capital letters."""

    name: str = ""
    """The whole name in capital letters, without quotes, for example that of a private glass."""


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
    >>> [(one.number, one.word, one.values) for one in read_commands("EPD 5; S 50 & ! front\n 3 BK7\nTIT 'a; b'")]
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
                raise wrong(f"line {number}", f"at most {MAX_WORDS:,} words in a command", "more")
        if not is_continued:
            yield from _command(start, words)
            words = []
    yield from _command(start, words)


def _command(number: int, words: list[str]) -> Iterator[Command]:
    if words:
        word, values = words[0].upper()[:MAX_NAME], tuple(word.strip(QUOTES) for word in words[1:])
        # Three letters make a command; more are the same one (TITLE, STOP).
        yield Command(number, word[:3] if word.isalpha() else word, values, word.strip(QUOTES))


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
