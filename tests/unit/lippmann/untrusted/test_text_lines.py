"""Lines of text from strangers: each limit holds, and a text just below it passes."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from lippmann.errors import InvalidText
from lippmann.optics.lens_files.codev.prescription import read_lens_seq
from lippmann.optics.lens_files.csv_files import read_lens_csv
from lippmann.optics.lens_files.glasses.agf import read_agf
from lippmann.optics.lens_files.zemax.prescription import read_lens_zmx
from lippmann.untrusted.text_lines import MAX_LINE, MAX_LINES, read_lines


def test_a_text_below_the_limits_is_read_with_its_line_numbers() -> None:
    lines = list(read_lines("a" * MAX_LINE + "\nb" * (MAX_LINES - 1)))
    assert lines[0] == (1, "a" * MAX_LINE)
    assert lines[-1] == (MAX_LINES, "b")


def test_lines_are_those_that_an_editor_counts() -> None:
    assert list(read_lines("a\r\nb\rc\x0cd\x85\u2028e\n\nf\n")) == [
        (1, "a"),
        (2, "b"),
        (3, "c\x0cd\x85\u2028e"),
        (4, ""),
        (5, "f"),
    ]


def test_too_many_lines_are_refused() -> None:
    with pytest.raises(InvalidText, match=r"^\(whole\): expected at most 20,000 lines, got 20,001$"):
        list(read_lines("\n" * (MAX_LINES + 1)))


def test_a_line_that_is_too_long_is_refused_with_its_number() -> None:
    with pytest.raises(InvalidText, match=r"^line 2: expected at most 10,000 characters, got 10,001$"):
        list(read_lines("a\n" + "b" * (MAX_LINE + 1)))


@pytest.mark.parametrize("read", [read_lens_csv, read_lens_zmx, read_lens_seq, read_agf])
def test_lens_designs_are_read_by_it(read: Callable[[str], object]) -> None:
    with pytest.raises(InvalidText, match="at most 20,000 lines"):
        read("\n" * (MAX_LINES + 1))
    with pytest.raises(InvalidText, match="line 1: expected at most 10,000 characters"):
        read(";" * (MAX_LINE + 1))
