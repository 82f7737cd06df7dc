"""Frame ranges, both ways."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import SpecError
from lippmann.job.animation.frames import format_frames, parse_frames

frame_sets = st.sets(st.integers(1, 999_999), min_size=1, max_size=50)


@given(frame_sets)
def test_formatting_and_parsing_are_inverse(numbers: set[int]) -> None:
    assert parse_frames(format_frames(numbers)) == tuple(sorted(numbers))


@given(st.integers(1, 500), st.integers(0, 500), st.integers(1, 20))
def test_a_range_with_a_step_starts_at_its_first_and_never_passes_its_last(first: int, more: int, step: int) -> None:
    numbers = parse_frames(f"{first}-{first + more}:{step}")
    assert numbers[0] == first
    assert numbers[-1] <= first + more < numbers[-1] + step
    assert all(b - a == step for a, b in pairwise(numbers))


def test_overlapping_parts_name_each_frame_once() -> None:
    assert parse_frames("3-5, 1-4, 4") == (1, 2, 3, 4, 5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("7-3", "counts up, got '7-3'"),
        ("", "frames like"),
        ("1-", "frames like"),
        ("a", "frames like '1-48:2, 60', got 'a'"),
        ("0", "from 1"),
        ("1-5:0", "step of 1 or more"),
        ("1-999999", "at most 300000 frames"),
        ("1000000", "to 999999"),
    ],
)
def test_bad_ranges_say_what_was_expected_and_what_came(text: str, message: str) -> None:
    with pytest.raises(SpecError, match=message):
        parse_frames(text)
