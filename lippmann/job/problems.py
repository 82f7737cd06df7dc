"""Validation errors of job files: the field, the expected value and the value received.

A field that accepts several forms selects the form by the shape of the value (`form_discriminator`). The tag of the
form stands in brackets in pydantic's error locations; `without_tags` removes it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from pydantic import BaseModel, Discriminator, ValidationError

from lippmann.errors import FieldProblem, first_problems
from lippmann.untrusted.shown import shown


class FieldError(ValueError):
    """The error of a validator that compares several fields; it names the field at fault.

    Parameters
    ----------
    field
        The path of the field in the model that is validated, as in `tiles`.
    expected
        The value that was expected.
    got
        The value that was received.
    """

    def __init__(self, field: str, *, expected: str, got: object) -> None:
        super().__init__(f"{field}: {expected}, got {got}")
        self.field, self.expected, self.got = field, expected, str(got)


def problems_of(error: ValidationError) -> tuple[FieldProblem, ...]:
    """Translate pydantic's errors, except those of defaults that depend on an invalid field."""
    errors = [item for item in error.errors(include_url=False) if item["type"] != "default_factory_not_called"]
    return first_problems(_problem(item) for item in errors)


def _problem(item: Any) -> FieldProblem:
    place, kind, got = _place(without_tags(item["loc"])), item["type"], item["input"]
    cause = item.get("ctx", {}).get("error")
    if isinstance(cause, FieldError):
        return FieldProblem(field=".".join((*place, cause.field)), expected=cause.expected, got=cause.got)
    field = ".".join(place) or "(whole)"
    if kind == "extra_forbidden":
        return FieldProblem(field=field, expected="no such field", got=shown(got))
    if kind == "missing":
        return FieldProblem(field=field, expected="a value", got="nothing")
    expected = str(item["msg"]).removeprefix("Value error, ")
    for prefix in ("Input should be ", "Value should be "):
        expected = expected.removeprefix(prefix)
    before, separator, after = expected.rpartition(", got ")
    return FieldProblem(field=field, expected=before or expected, got=after if separator else shown(got))


def _place(parts: tuple[str, ...]) -> tuple[str, ...]:
    """Return the path in the job file: keyframes are written in place of the number that they animate."""
    return parts[1:] if len(parts) > 1 and parts[0] == "animation" else parts


def form_discriminator(form_of: Callable[[Any], str]) -> Discriminator:
    """Return a discriminator whose tag is the result of `form_of` for the value, in brackets."""

    def form(value: Any) -> str:
        return f"({form_of(value.model_dump() if isinstance(value, BaseModel) else value)})"

    return Discriminator(form)


def without_tags(place: Iterable[Any]) -> tuple[str, ...]:
    """Return the location of an error without the tags of forms.

    >>> without_tags(("rig", "imaging_lens", "(scaled)", "focal_length_mm"))
    ('rig', 'imaging_lens', 'focal_length_mm')
    """
    return tuple(str(part) for part in place if not str(part).startswith("("))
