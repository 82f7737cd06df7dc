"""TOML from strangers, with limits on size, depth, keys and the parts of a dotted key.

The time of `tomllib` grows with the square of the parts of a dotted key, and it recurses with nested brackets.
"""

from __future__ import annotations

import re
import tomllib
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from typing import Any, NoReturn

from lippmann.errors import FieldProblem, InvalidText

MAX_BYTES = 256 * 1024
MAX_DEPTH = 32
MAX_PARTS = 16
"""The greatest number of parts of a dotted key; a key of a scene has at most 4."""
MAX_ITEMS = 10_000
"""The greatest number of keys, tables and items of lists together."""
MAX_LINES = 20_000
MAX_LENGTH = 400
"""The greatest length of a number, or of a key without quotes."""

_TEXT = re.compile(
    r"""
      \#[^\n]*+
    | \"\"\"(?:[^"\\]++|\\.|"(?!""))*+(?:"{3,5}|\\?\Z)
    | '''(?:[^']++|'(?!''))*+(?:'{3,5}|\Z)
    | "(?!"")(?:[^"\\\n]++|\\[^\n])*+"?
    | '(?!'')[^'\n]*+'?
    """,
    re.VERBOSE | re.DOTALL,
)
"""A comment, a text in quotes, or a text that does not end, which no parser gets behind.

The quantifiers are possessive: the scan is linear.
"""
_STATEMENT_END = re.compile(r"[][{}=,\n]")
_WORD_END = re.compile(r"[][{}=,.\s]+")
_BRACKET = re.compile(r"[][{}]")


def read_toml(data: bytes, *, field: str) -> dict[str, Any]:
    """Return the table of a TOML text.

    Raises
    ------
    InvalidText
        If the text is not TOML in UTF-8, or exceeds a limit; the error names the place.
    """
    if len(data) > MAX_BYTES:
        _refuse(field, f"at most {MAX_BYTES:,} bytes", f"{len(data):,}")
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        _refuse(field, "TOML in UTF-8", "UTF-16")
    try:
        text = data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = 1 + data.count(b"\n", 0, error.start)
        got = f"byte {data[error.start]:#04x} in line {line}; save the file as UTF-8"
        raise InvalidText(FieldProblem(field=field, expected="TOML in UTF-8", got=got)) from error
    try:
        _scan(text, field)
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidText(FieldProblem(field=field, expected="TOML in UTF-8", got=str(error))) from error


def _scan(text: str, field: str) -> None:
    if text.count("\n") >= MAX_LINES:
        _refuse(field, f"at most {MAX_LINES:,} lines", f"{text.count(chr(10)) + 1:,}")
    marks = _TEXT.sub('""', text)
    items = marks.count("=") + marks.count(",") + marks.count("[")
    if items > MAX_ITEMS:
        _refuse(field, f"at most {MAX_ITEMS:,} keys and items", f"{items:,}")
    parts = 1 + max(key.count(".") for key in _STATEMENT_END.split(marks))
    if parts > MAX_PARTS:
        _refuse(field, f"dotted keys of at most {MAX_PARTS} parts", f"one of {parts:,}")
    length = max(map(len, _WORD_END.split(marks)))
    if length > MAX_LENGTH:
        _refuse(field, f"numbers and bare keys of at most {MAX_LENGTH} characters", f"one of {length:,}")
    depth = 0
    for bracket in _BRACKET.finditer(marks):
        depth += 1 if bracket.group() in "[{" else -1
        if depth > MAX_DEPTH:
            _refuse(field, f"at most {MAX_DEPTH} levels of brackets", "more")


def _refuse(field: str, expected: str, got: str) -> NoReturn:
    raise InvalidText(FieldProblem(field=field, expected=expected, got=got))
