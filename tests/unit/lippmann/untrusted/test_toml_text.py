"""TOML from strangers: each limit holds, and a text just below it passes."""

from __future__ import annotations

import contextlib
import time
import tomllib

import pytest

from lippmann.errors import InvalidText
from lippmann.untrusted.toml_text import MAX_BYTES, MAX_DEPTH, MAX_ITEMS, MAX_LENGTH, MAX_LINES, MAX_PARTS, read_toml


def dotted(parts: int) -> str:
    return ".".join("a" * parts) + " = 1"


@pytest.mark.parametrize(
    ("below", "above", "expected"),
    [
        ("#" * MAX_BYTES, "#" * (MAX_BYTES + 1), "at most 262,144 bytes, got 262,145"),
        (dotted(MAX_PARTS), dotted(MAX_PARTS + 1), "dotted keys of at most 16 parts, got one of 17"),
        (f"[{dotted(MAX_PARTS)[:-4]}]", f"[{dotted(MAX_PARTS + 1)[:-4]}]", "dotted keys of at most 16 parts"),
        ("a=" + "[" * MAX_DEPTH + "]" * MAX_DEPTH, "a=" + "[" * 33 + "]" * 33, "at most 32 levels of brackets"),
        ("a=" + "{a=" * MAX_DEPTH + "1" + "}" * MAX_DEPTH, "a=" + "{a=" * 33 + "1" + "}" * 33, "at most 32 levels"),
        (f"a=0x{'1' * (MAX_LENGTH - 2)}", f"a=0x{'1' * (MAX_LENGTH - 1)}", "numbers .* of at most 400 characters"),
        ("a=[" + "1," * (MAX_ITEMS - 2) + "]", "a=[" + "1," * (MAX_ITEMS - 1) + "]", "at most 10,000 keys and items"),
        ("\n" * (MAX_LINES - 1), "\n" * MAX_LINES, "at most 20,000 lines, got 20,001"),
    ],
    ids=["size", "key", "table", "lists", "objects", "digits", "items", "lines"],
)
def test_a_text_below_a_limit_passes_and_one_above_is_refused(below: str, above: str, expected: str) -> None:
    read_toml(below.encode(), field="scene.toml")
    with pytest.raises(InvalidText, match=f"^scene.toml: expected {expected}"):
        read_toml(above.encode(), field="scene.toml")


def test_a_byte_order_mark_is_skipped_and_utf_16_is_named() -> None:
    assert read_toml("a = 1".encode("utf-8-sig"), field="scene.toml") == {"a": 1}
    with pytest.raises(InvalidText, match=r"^scene.toml: expected TOML in UTF-8, got UTF-16"):
        read_toml("a = 1".encode("utf-16"), field="scene.toml")


@pytest.mark.parametrize(
    "text",
    [
        'a = "[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[" # \'\'\' """ [[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[',
        'a = """\n[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[ "" \\""" a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a"""""\nb = 1',
        "a = '''\n[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[ '' \" a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a'''''\nb = 1",
        "a = '\"[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[' # '\nb = \"#\"",
        '"a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a".b = 1.5',
    ],
)
def test_marks_inside_of_texts_and_comments_do_not_count(text: str) -> None:
    assert read_toml(text.encode(), field="scene.toml") == tomllib.loads(text)


@pytest.mark.parametrize("text", ["a = ", "a = 1\na = 2", '"', "a = '''", 'a = """\\', "a = [", "\x00"])
def test_a_text_that_is_no_toml_is_refused(text: str) -> None:
    with pytest.raises(InvalidText, match=r"^scene\.toml: expected TOML in UTF-8, got "):
        read_toml(text.encode(), field="scene.toml")


def test_text_that_is_not_utf_8_is_refused() -> None:
    with pytest.raises(InvalidText, match="expected TOML in UTF-8, got byte 0xff in line 2"):
        read_toml(b"title = 1\n\xff", field="scene.toml")


@pytest.mark.parametrize("piece", [b'\\"""', b"'''a", b'"""', b"#", b" ", b"[[a]]\n", b"a.b.c.d.e.f=1\n", b'"\\n'])
def test_no_text_of_the_largest_size_takes_a_second(piece: bytes) -> None:
    """The time is that of this thread alone: a busy machine does not count."""
    for head in (b"", b'a = """', b"a = '''", b'a = "', b"a = ["):
        began_s = time.thread_time()
        with contextlib.suppress(InvalidText):
            read_toml((head + piece * MAX_BYTES)[:MAX_BYTES], field="scene.toml")
        assert time.thread_time() - began_s < 1
