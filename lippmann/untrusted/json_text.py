"""JSON from strangers, with limits on size, depth, counts and digits."""

from __future__ import annotations

import json
import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, NoReturn

from lippmann.errors import FieldProblem, InvalidText

_TEXT = re.compile(r'"(?:[^"\\]++|\\.)*+(?:"|\\?\Z)', re.DOTALL)
"""A text in quotes, or one that does not end, up to the end. The quantifiers are possessive: the scan is linear."""
_BRACKET = re.compile(r"[][{}]")
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


@dataclass(frozen=True)
class JsonLimits:
    """The limits of a JSON text."""

    size_bytes: int = 2_000_000
    depth: int = 64
    """The greatest depth of brackets; a job has less than 12."""
    names: int = 10_000
    """The greatest number of names of fields in all objects together."""
    values: int = 120_000
    """The greatest number of items of lists and objects together; a list of 100,000 frames is the longest."""
    digits: int = 400
    """The greatest length of a whole number; the greatest double has 309 digits before its decimal point."""


LIMITS = JsonLimits()


def read_json(data: bytes | str, *, field: str, limits: JsonLimits = LIMITS) -> Any:
    """Return the value of a JSON text.

    Parameters
    ----------
    data
        The text; bytes are UTF-8.
    field
        The name of the text in the error.
    limits
        The limits of the text.

    Raises
    ------
    InvalidText
        If the text is no JSON of RFC 8259, exceeds a limit, or contains half of a surrogate pair.
    """
    if len(data) > limits.size_bytes:
        _refuse(field, f"at most {limits.size_bytes:,} bytes", f"{len(data):,}")
    text = _decoded(data, field)
    _scan(text, field, limits)
    try:
        value = json.loads(text, parse_constant=_refuse_constant, parse_int=partial(_integer, field, limits))
    except (ValueError, RecursionError) as error:
        raise InvalidText(FieldProblem(field=field, expected="JSON", got=_syntax(error))) from error
    if _SURROGATE.search(text):
        _check_texts(value, field)
    return value


def _decoded(data: bytes | str, field: str) -> str:
    if isinstance(data, str):
        return data
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        raise InvalidText(FieldProblem(field=field, expected="JSON in UTF-8", got="UTF-16"))
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        got = f"{error.reason} at byte {error.start}"
        raise InvalidText(FieldProblem(field=field, expected="JSON in UTF-8", got=got)) from error


def _scan(text: str, field: str, limits: JsonLimits) -> None:
    marks = _TEXT.sub("", text)
    if marks.count(":") > limits.names:
        _refuse(field, f"at most {limits.names:,} names of fields", f"{marks.count(':'):,}")
    values = marks.count(",") + marks.count("[") + marks.count("{")
    if values > limits.values:
        _refuse(field, f"at most {limits.values:,} values", f"{values:,}")
    depth = 0
    for bracket in _BRACKET.finditer(marks):
        depth += 1 if bracket.group() in "[{" else -1
        if depth > limits.depth:
            _refuse(field, f"at most {limits.depth} levels of brackets", "more")


def _check_texts(value: Any, field: str) -> None:
    for path, text in _texts(value):
        try:
            text.encode()
        except UnicodeEncodeError:
            got = f"half of a surrogate pair: {text[:40]!a}"
            place = ascii(".".join(path))[1:-1] or field
            raise InvalidText(FieldProblem(field=place, expected="text of whole characters", got=got)) from None


def _texts(value: Any) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield every text of a JSON value with its path; the walk is not recursive."""
    left: list[tuple[tuple[str, ...], Any]] = [((), value)]
    while left:
        path, item = left.pop()
        if isinstance(item, str):
            yield path, item
        elif isinstance(item, list):
            left.extend(((*path, str(place)), part) for place, part in enumerate(item))
        elif isinstance(item, dict):
            for name, part in item.items():
                yield path, name
                left.append(((*path, name), part))


def _syntax(error: Exception) -> str:
    if isinstance(error, json.JSONDecodeError):
        return f"{error.msg} at line {error.lineno}, column {error.colno}"
    return str(error)


def _integer(field: str, limits: JsonLimits, text: str) -> int:
    if len(text) > limits.digits:
        _refuse(field, f"whole numbers of at most {limits.digits} digits", f"one of {len(text):,}")
    return int(text)


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name}, which is no number of JSON")


def _refuse(field: str, expected: str, got: str) -> NoReturn:
    raise InvalidText(FieldProblem(field=field, expected=expected, got=got))
