"""Values in messages: the beginning of their `repr`, whatever their size."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.untrusted.shown import MAX_SHOWN, shown


@pytest.mark.parametrize(
    "value", [None, True, 1.5, "a'b", b"a", [], [1, "a"], (), (1,), (1, 2), {}, {"a": [{}, 1], "b": None}, {1, 2}]
)
def test_a_short_value_is_shown_as_its_repr(value: Any) -> None:
    assert shown(value) == repr(value)


@pytest.mark.parametrize(
    "value", ["a" * 10**7, [0] * 10**6, {"a": "b" * 10**7}, [[["x" * 500]]]], ids=["text", "list", "object", "nested"]
)
def test_a_long_value_is_cut(value: Any) -> None:
    assert len(shown(value)) == MAX_SHOWN
    assert shown(value).endswith("...")


def test_a_value_of_any_depth_is_shown() -> None:
    value: list[Any] = []
    for _ in range(100_000):
        value = [value]
    assert shown(value) == "[" * (MAX_SHOWN - 3) + "..."


def test_a_number_that_python_does_not_print_is_described() -> None:
    assert shown([10**5000]) == "[a number of 16610 bits]"
