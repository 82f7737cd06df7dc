"""A value of another JSON type is refused and not converted."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.errors import SpecError
from lippmann.job.spec import parse_spec
from service.schemas.access import KeyRequest


@pytest.mark.parametrize(
    ("field", "value", "expected"),
    [
        ("slots", True, "a whole number"),
        ("slots", "3", "a whole number"),
        ("fps", True, "a number"),
        ("fps", "8", "a number"),
        ("capture.depth", 1, "true or false"),
        ("capture.depth", "true", "true or false"),
        ("rig.lens_array.count", [True, 3], "a whole number"),
        ("rig.lens_array.count", ["3", 3], "a whole number"),
    ],
)
def test_a_value_of_another_type_is_refused(field: str, value: Any, expected: str) -> None:
    nested = value
    for name in reversed(field.split(".")):
        nested = {name: nested}
    with pytest.raises(SpecError) as caught:
        parse_spec({"scene": "fish"} | nested)
    assert [(problem.field, problem.expected) for problem in caught.value.problems] == [(field, expected)]


def test_whole_numbers_count_as_numbers_and_parameters_may_be_of_any_type() -> None:
    spec = parse_spec({"scene": "fish", "fps": 8, "priority": 60.0, "parameters": {"a": True, "b": "#ffffff", "c": 2}})
    assert (spec.fps, spec.priority, spec.parameters) == (8.0, 60, {"a": True, "b": "#ffffff", "c": 2})


def test_the_body_of_a_request_keeps_its_types() -> None:
    with pytest.raises(ValueError, match=r"limits\.tasks"):
        KeyRequest.model_validate({"name": "a", "limits": {"tasks": True}})
