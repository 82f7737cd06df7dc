"""What pydantic found wrong, as fields with what was expected and what came."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from worker.errors import FieldProblem
from worker.job.misfit import Misfit
from worker.job.tagged import untagged


def problems_of(error: ValidationError) -> tuple[FieldProblem, ...]:
    """Translate pydantic's errors: field, expected, got; not those of defaults that follow from what is wrong."""
    errors = (item for item in error.errors(include_url=False) if item["type"] != "default_factory_not_called")
    return tuple(_problem(item) for item in errors)


def _problem(item: Any) -> FieldProblem:
    place, kind, got = _place(untagged(item["loc"])), item["type"], item["input"]
    cause = item.get("ctx", {}).get("error")
    if isinstance(cause, Misfit):
        return FieldProblem(field=".".join((*place, cause.field)), expected=cause.expected, got=cause.got)
    field = ".".join(place) or "(whole)"
    if kind == "extra_forbidden":
        return FieldProblem(field=field, expected="no such field", got=_short(got))
    if kind == "missing":
        return FieldProblem(field=field, expected="a value", got="nothing")
    expected = str(item["msg"]).removeprefix("Value error, ")
    for prefix in ("Input should be ", "Value should be "):
        expected = expected.removeprefix(prefix)
    told, says_what_came, came = expected.rpartition(", got ")
    return FieldProblem(field=field, expected=told or expected, got=came if says_what_came else _short(got))


def _place(parts: tuple[str, ...]) -> tuple[str, ...]:
    """Return where a user wrote what is wrong: keyframes stand in place of the number that they move."""
    return parts[1:] if len(parts) > 1 and parts[0] == "animation" else parts


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 120 else text[:117] + "..."
