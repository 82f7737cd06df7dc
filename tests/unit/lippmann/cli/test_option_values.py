"""Options that hold several numbers: x before y, and columns before rows."""

from __future__ import annotations

import pytest

from lippmann.cli.option_values import count_of, first_lens_of, frames_of
from lippmann.errors import BadInput


@pytest.mark.parametrize("text", ["115x100", " 115 X 100 ", "115*100"])
def test_lenses_are_counted_across_and_then_down(text: str) -> None:
    assert count_of(text) == (100, 115)


@pytest.mark.parametrize("text", ["115", "115,100", "-1x2", "1x2x3", "1.5x2", "", "²x2", "9999999x1"])
def test_what_is_no_number_of_lenses_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(BadInput, match="--lenses: expected lenses across and down as COLSxROWS, such as 115x100, got"):
        count_of(text)


def test_the_first_lens_lies_so_far_to_the_right_and_then_down() -> None:
    assert first_lens_of("11.5,4") == (4.0, 11.5)
    with pytest.raises(BadInput, match="expected --first-lens-px as RIGHT,DOWN in px, got 4"):
        first_lens_of("4")


def test_the_old_names_have_the_old_order_and_a_note_with_the_new_one() -> None:
    with pytest.warns(FutureWarning, match="^--lens-count 100 115 is now --lenses 115x100; the next release drops"):
        assert count_of(None, (100, 115)) == (100, 115)
    with pytest.warns(FutureWarning, match=r"^--offset-px 4,11.5 is now --first-lens-px 11.5,4; "):
        assert first_lens_of(None, "4,11.5") == (4.0, 11.5)


def test_no_option_is_no_number() -> None:
    assert (count_of(None), first_lens_of(None), frames_of(None)) == (None, None, None)
