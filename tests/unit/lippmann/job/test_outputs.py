"""Outputs as a job asks for them: two spellings, names of their own, and rows of the database that hold them."""

from __future__ import annotations

import pytest
from sqlalchemy import String

from lippmann.errors import SpecError
from lippmann.job.outputs.choice import spelled_out, spellings
from lippmann.job.outputs.output import KINDS
from lippmann.job.spec import parse_spec
from service.db.tables import Task


@pytest.mark.parametrize("written", spellings())
def test_a_short_spelling_is_the_name_of_the_file_that_comes(written: str) -> None:
    options = spelled_out(written)
    assert KINDS[options["kind"]].model_validate(options).file_name == written


def test_the_database_has_room_for_the_longest_name_of_every_kind() -> None:
    column = Task.__table__.c.output.type
    assert isinstance(column, String)
    assert column.length is not None
    for written in spellings():
        options = spelled_out(written)
        assert len(KINDS[options["kind"]].model_validate(options | {"name": "n" * 50}).file_name) <= column.length
        with pytest.raises(ValueError, match="at most 50"):
            KINDS[options["kind"]].model_validate(options | {"name": "n" * 51})


@pytest.mark.parametrize(
    ("outputs", "problem"),
    [
        (["view_grid.png", {"kind": "view_grid", "bits": 16}], "outputs.1.name: expected a name of its own"),
        ([{"kind": "view_grid", "name": "../up"}], "outputs.0.name: expected"),
        ([{"kind": "nothing"}], "outputs.0.kind: expected one of anaglyph, calibration_sheet,"),
        ([{}], "outputs.0.kind: expected one of .*, got nothing"),
        ([7], "outputs.0: expected an object with a kind, or the name of a file, got 7"),
        ([{"kind": "view_grid", "bit": 8}], "outputs.0.bit: expected no field of this name"),
        (["views.mp4"] * 101, "outputs: expected .*at most 100"),
    ],
)
def test_what_is_wrong_is_named_by_its_place(outputs: list[object], problem: str) -> None:
    with pytest.raises(SpecError, match=problem):
        parse_spec({"scene": "fish", "outputs": outputs})


def test_the_same_kind_twice_with_names_of_their_own() -> None:
    spec = parse_spec({"scene": "fish", "outputs": ["views.mp4", {"kind": "views", "codec": "ffv1", "name": "exact"}]})
    assert [output.file_name for output in spec.outputs] == ["views.mp4", "exact.mkv"]
