"""Lines of lens design files."""

from __future__ import annotations

import math

import pytest

from lippmann.errors import SpecError
from lippmann.optics.lens_files.lines import Line, finite_number


def test_numbers_are_read_from_their_places() -> None:
    line = Line(7, "DISZ", ("1.5", "inf", "-2e-3"))
    assert (line.value(), line.distance(1), line.value(2)) == (1.5, math.inf, -0.002)
    assert Line(7, "VUY", ("0", "0.2")).all_numbers() == [0.0, 0.2]


def test_leading_numbers_end_at_the_first_word() -> None:
    assert Line(7, "FTYP", ("0", "nan", "3", "X", "4")).leading_numbers() == [0.0, 0.0, 3.0]


@pytest.mark.parametrize(
    ("values", "distance", "value"),
    [
        (("F2",), "a number, got F2", "a number, got F2"),
        ((), "a number, got nothing", "a number, got nothing"),
        (("nan",), "a number, got nan", "a finite number, got nan"),
        (("inf",), "", "a finite number, got inf"),
        (("'1,5'", "x"), "a number, got 1,5' x", "a number, got 1,5' x"),
    ],
)
def test_the_error_names_the_line(values: tuple[str, ...], distance: str, value: str) -> None:
    line = Line(7, "CURV", values)
    for read, expected in ((line.distance, distance), (line.value, value)):
        if expected:
            with pytest.raises(SpecError, match=f"^line 7, CURV: expected {expected}$"):
                read()


@pytest.mark.parametrize("text", ["", "x", "nan", "-inf", "1,5", "0x10"])
def test_other_texts_are_no_finite_numbers(text: str) -> None:
    assert finite_number(text) is None
