"""Errors that name fields: their texts and their number are bounded."""

from __future__ import annotations

from lippmann.errors import MAX_PROBLEMS, MAX_TEXT, FieldProblem, SpecError, first_problems


def problems(count: int) -> list[FieldProblem]:
    return [FieldProblem(field=f"f{number}", expected="a number", got="nothing") for number in range(count)]


def test_a_long_text_of_a_problem_is_cut() -> None:
    problem = FieldProblem(field="f" * 10**6, expected="a" * MAX_TEXT, got="g" * (MAX_TEXT + 1))
    assert len(problem.field) == len(problem.expected) == len(problem.got) == MAX_TEXT
    assert problem.got.endswith("...")
    assert problem.expected.endswith("aaa")


def test_an_error_names_the_first_problems_and_counts_the_others() -> None:
    error = SpecError.of(problems(MAX_PROBLEMS + 1000))
    assert error.problems[:MAX_PROBLEMS] == tuple(problems(MAX_PROBLEMS))
    assert error.message.endswith("(whole): expected no further problems, got 1,000 more")
    assert len(error.problems) == MAX_PROBLEMS + 1


def test_problems_that_were_counted_once_are_not_counted_again() -> None:
    counted = first_problems(problems(9999))
    assert first_problems(counted) == counted


def test_problems_that_were_not_translated_are_counted_too() -> None:
    *named, rest = first_problems(problems(2), more=3)
    assert named == problems(2)
    assert rest.got == "3 more"


def test_one_problem_beyond_the_limit_is_named_as_well() -> None:
    assert first_problems(problems(MAX_PROBLEMS + 1)) == tuple(problems(MAX_PROBLEMS + 1))
