"""JSON from strangers: each limit holds, and a text just below it passes."""

from __future__ import annotations

import pytest

from lippmann.errors import InvalidText
from lippmann.untrusted.json_text import JsonLimits, read_json

LIMITS = JsonLimits(size_bytes=1000, depth=5, names=10, values=20, digits=30)


def objects(count: int) -> str:
    return "{" + ", ".join(f'"n{place}": 0' for place in range(count)) + "}"


@pytest.mark.parametrize(
    ("below", "above", "expected"),
    [
        ('"' + "a" * 998 + '"', '"' + "a" * 999 + '"', "at most 1,000 bytes, got 1,001"),
        ("[" * 5 + "]" * 5, "[" * 6 + "]" * 6, "at most 5 levels of brackets, got more"),
        ('{"a":' * 5 + "0" + "}" * 5, '{"a":' * 6 + "0" + "}" * 6, "at most 5 levels of brackets, got more"),
        (objects(10), objects(11), "at most 10 names of fields, got 11"),
        ("[" + "1," * 19 + "1]", "[" + "1," * 20 + "1]", "at most 20 values, got 21"),
        ("1" * 30, "1" * 31, "whole numbers of at most 30 digits, got one of 31"),
    ],
    ids=["size", "lists", "objects", "names", "values", "digits"],
)
def test_a_text_below_a_limit_passes_and_one_above_is_refused(below: str, above: str, expected: str) -> None:
    read_json(below, field="body", limits=LIMITS)
    with pytest.raises(InvalidText, match=f"^body: expected {expected}$"):
        read_json(above, field="body", limits=LIMITS)


def test_marks_inside_of_texts_do_not_count() -> None:
    text = r'["[[[[[[[[[[[[", "\"{{{{{{{{{", ",,,,,,,,,,,,,,,,,,,,,,", "::::::::::::::"]'
    assert len(read_json(text, field="body", limits=LIMITS)) == 4


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"{", "body: expected JSON, got Expecting property name enclosed in double quotes at line 1, column 2"),
        (b'["a', "body: expected JSON, got Unterminated string starting at at line 1, column 2"),
        (b"NaN", "body: expected JSON, got NaN, which is no number of JSON"),
        (b"\xff", "body: expected JSON in UTF-8, got invalid start byte at byte 0"),
        ("{}".encode("utf-16"), "body: expected JSON in UTF-8, got UTF-16"),
        ("{}".encode("utf-16-le"), "body: expected JSON, got Expecting property name"),
        (b'{"a": [{"t": "\\ud800"}]}', r"a\.0\.t: expected text of whole characters, got half of a surrogate pair"),
        (b'{"\\uDFFF": 1}', "body: expected text of whole characters, got half of a surrogate pair"),
    ],
)
def test_a_text_that_is_no_json_is_refused_with_its_place(data: bytes, message: str) -> None:
    with pytest.raises(InvalidText, match=f"^{message}"):
        read_json(data, field="body")


def test_a_whole_surrogate_pair_is_a_character() -> None:
    assert read_json(rb'"\ud83d\ude00"', field="body") == "\N{GRINNING FACE}"


def test_a_mark_of_the_byte_order_is_no_part_of_the_text() -> None:
    assert read_json(b"\xef\xbb\xbf[]", field="body") == []
