"""Python values as SDL text."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from povtemplates import literals


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_keeps_all_its_digits(value: float) -> None:
    assert float(literals.number(value)) == value


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_number_that_sdl_cannot_say_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        literals.number(value)
