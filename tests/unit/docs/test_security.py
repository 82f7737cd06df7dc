"""SECURITY.md promises what a test shows, and nothing else: its tables are written from the markers of the tests."""

from __future__ import annotations

import pytest

from tests.security.promises import (
    BEGIN,
    END,
    PAGE,
    SECTIONS,
    Promise,
    UnclearPromiseError,
    all_promises,
    promises_of,
    tables,
    with_tables,
)

MARKER = '@pytest.mark.promise("Scenes", "A scene is held.")\n'


def test_the_page_is_as_make_promises_writes_it() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page == with_tables(page, all_promises()), "run `make promises`"


def test_every_section_has_a_promise() -> None:
    assert {promise.section for promise in all_promises()} == set(SECTIONS)


def test_a_marker_is_a_promise_and_every_marker_of_a_test_counts() -> None:
    other = '@pytest.mark.parametrize("x", [1])\n@pytest.mark.promise("People", "A key ends.")\n'
    found = list(promises_of(f"{MARKER}{other}def test_a(x): ...\n\ndef test_b(): ...\n", "tests/test_c.py"))
    assert found == [
        Promise("Scenes", "A scene is held.", "tests/test_c.py::test_a"),
        Promise("People", "A key ends.", "tests/test_c.py::test_a"),
    ]


def test_a_promise_that_two_tests_show_is_one_row() -> None:
    written = tables([Promise("Scenes", "Held.", "a::test_a"), Promise("Scenes", "Held.", "b::test_b")])
    assert "| Held. | `a::test_a`, `b::test_b` |\n" in written


@pytest.mark.parametrize(
    ("source", "problem"),
    [
        ('@pytest.mark.promise("Scene", "Held.")\ndef test_a(): ...', r"^a\.py:1: expected a section .* got 'Scene'"),
        ("@pytest.mark.promise(SECTION, TEXT)\ndef test_a(): ...", r"^a\.py:1: expected .* two literal texts"),
        ('@pytest.mark.promise("Scenes")\ndef test_a(): ...', r"^a\.py:1: expected .* two literal texts"),
        ('@pytest.mark.promise("Scenes", "Held")\ndef test_a(): ...', r"^a\.py:1: expected one sentence"),
        ('@pytest.mark.promise("Scenes", "a | b.")\ndef test_a(): ...', r"^a\.py:1: expected one sentence"),
        (f"{MARKER}def helper(): ...", "expected the marker on a test at the top of a module, got it on 'helper'"),
        (f"class TestA:\n    {MARKER}    def test_a(self): ...", "got it on 'test_a'"),
        (f"{MARKER}class TestA: ...", "got it on 'TestA'"),
    ],
)
def test_a_marker_that_is_unclear_is_refused_with_its_place(source: str, problem: str) -> None:
    with pytest.raises(UnclearPromiseError, match=problem):
        list(promises_of(source, "a.py"))


def test_what_stands_around_the_tables_is_kept() -> None:
    page = f"# Security\n\n{BEGIN}\nold\n{END}\n\n## How to report\n"
    written = with_tables(page, [Promise("Scenes", "Held.", "a::test_a")])
    assert (written.startswith("# Security\n"), written.endswith("## How to report\n")) == (True, True)
    assert "old" not in written
    with pytest.raises(ValueError, match="expected the lines"):
        with_tables("# Security\n", [])
