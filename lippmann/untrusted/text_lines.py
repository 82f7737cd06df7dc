"""Text of lines from strangers, with limits on the number of lines and their length."""

from __future__ import annotations

from collections.abc import Iterator

from lippmann.errors import FieldProblem, InvalidText

MAX_LINES = 20_000
"""A design of a zoom lens has a few thousand."""
MAX_LINE = 10_000


def read_lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield the lines of a text with their numbers from 1.

    Raises
    ------
    InvalidText
        If there are too many lines, or one is too long.
    """
    # Editors count these line ends; `splitlines` also cuts at form feeds and at separators of Unicode.
    lines = text.replace("\r\n", "\n").replace("\r", "\n").removesuffix("\n").split("\n")
    if len(lines) > MAX_LINES:
        expected = f"at most {MAX_LINES:,} lines"
        raise InvalidText(FieldProblem(field="(whole)", expected=expected, got=f"{len(lines):,}"))
    for number, line in enumerate(lines, start=1):
        if len(line) > MAX_LINE:
            expected = f"at most {MAX_LINE:,} characters"
            raise InvalidText(FieldProblem(field=f"line {number}", expected=expected, got=f"{len(line):,}"))
        yield number, line
