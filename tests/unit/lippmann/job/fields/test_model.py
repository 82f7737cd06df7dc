"""Lists of a job: their length is checked before their items."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import pytest
from pydantic import Field, ValidationError

from lippmann.errors import MAX_PROBLEMS, SpecError
from lippmann.job.fields.model import LEAST, JobModel, at_most
from lippmann.job.fields.problems import MAX_TRANSLATED
from lippmann.job.spec import parse_spec

LISTS: dict[str, Callable[[Any], dict[str, Any]]] = {
    "outputs": lambda items: {"outputs": items},
    "rig.imaging_lens.surfaces": lambda items: {"rig": {"imaging_lens": {"surfaces": items}}},
    "rig.imaging_lens.surfaces.0.aspheric": lambda items: {
        "rig": {"imaging_lens": {"surfaces": [{"aspheric": items}]}}
    },
    "rig.f_number.keyframes": lambda items: {"animation": {"rig.f_number": {"keyframes": items}}},
    "outputs.0.lens_rows": lambda items: {"outputs": [{"kind": "epi", "lens_rows": items}]},
    "outputs.0.lens_cols": lambda items: {"outputs": [{"kind": "epi", "lens_cols": items}]},
}


class Row(JobModel):
    """A model with one list."""

    items: Annotated[tuple[int, ...], Field(max_length=3), at_most(3)] = ()


def test_a_list_of_too_many_items_has_one_error_whatever_they_are() -> None:
    assert Row(items=(1, 2, 3)).items == (1, 2, 3)
    with pytest.raises(ValidationError) as raised:
        Row.model_validate({"items": [{}] * 4})
    (error,) = raised.value.errors()
    assert (error["type"], error["loc"], error["ctx"]["max_length"]) == ("too_long", ("items",), 3)


@pytest.mark.parametrize("field", LISTS)
def test_a_long_list_of_nonsense_in_a_job_is_one_problem(field: str) -> None:
    spec: dict[str, Any] = {"scene": "fish", **LISTS[field]([{}] * 5000)}
    with pytest.raises(SpecError) as raised:
        parse_spec(spec)
    found = [problem for problem in raised.value.problems if problem.field.startswith(field)]
    assert len(found) == 1, raised.value
    assert found[0].expected.removeprefix("a list of ").startswith("at most ")


def test_very_many_unknown_fields_are_counted_though_not_all_are_translated() -> None:
    unknown = MAX_TRANSLATED + 200
    with pytest.raises(SpecError) as raised:
        parse_spec({"scene": "fish", **{f"f{number}": 1 for number in range(unknown)}})
    assert raised.value.problems[-1].got == f"{unknown - MAX_PROBLEMS:,} more"


@pytest.mark.parametrize(
    ("field", "spec"),
    [
        ("outputs.0.pitch_um", {"outputs": [{"kind": "calibration_sheet", "pitch_um": 5e-324}]}),
        ("outputs.0.dpi", {"outputs": [{"kind": "print", "dpi": 5e-324}]}),
        ("rig.lens_array.pitch_mm", {"rig": {"lens_array": {"pitch_mm": 1e-13}}}),
        ("fps", {"fps": 1e-200}),
        ("display.viewing_distance_mm", {"display": {"viewing_distance_mm": 1e-200}}),
    ],
)
def test_a_number_that_is_almost_nothing_is_refused_by_its_name(field: str, spec: dict[str, Any]) -> None:
    with pytest.raises(SpecError) as raised:
        parse_spec({"scene": "fish", **spec})
    (problem,) = raised.value.problems
    assert problem.field == field
    assert problem.expected == f"a number of at least {LEAST:g}"


def test_a_place_may_be_almost_0_as_trigonometry_makes_it() -> None:
    spec = parse_spec({"scene": "fish", "stage": {"location": [0, 6.1e-17, -5]}})
    assert spec.stage.location == (0, 6.1e-17, -5)
