"""Validation problems of job files: pydantic's errors as fields with what was expected and what came.

A field that accepts several forms chooses the form by what was written (`told_by`). The tag of the form stands in
pydantic's error locations in brackets; `untagged` removes it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from pydantic import BaseModel, Discriminator, ValidationError

from lippmann.errors import FieldProblem


class Misfit(ValueError):
    """What a validator of several fields raises, so that the message names one of them.

    Parameters
    ----------
    field
        From the part that is validated, as in `tiles`.
    """

    def __init__(self, field: str, *, expected: str, got: object) -> None:
        super().__init__(f"{field}: {expected}, got {got}")
        self.field, self.expected, self.got = field, expected, str(got)


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


def told_by(form_of: Callable[[Any], str]) -> Discriminator:
    """Return a discriminator that brackets the tag which `form_of` tells from what was written."""

    def form(value: Any) -> str:
        return f"({form_of(value.model_dump() if isinstance(value, BaseModel) else value)})"

    return Discriminator(form)


def untagged(place: Iterable[Any]) -> tuple[str, ...]:
    """Return the place of an error without tags.

    >>> untagged(("rig", "imaging_lens", "(scaled)", "focal_length_mm"))
    ('rig', 'imaging_lens', 'focal_length_mm')
    """
    return tuple(str(part) for part in place if not str(part).startswith("("))
