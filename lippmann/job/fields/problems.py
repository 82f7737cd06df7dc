"""Validation errors of job files: the field, the expected value and the value received.

A field that accepts several forms selects the form by the shape of the value (`form_discriminator`). The tag of the
form stands in brackets in pydantic's error locations; `without_tags` removes it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel, Discriminator, ValidationError

from lippmann.errors import MAX_PROBLEMS, FieldProblem, first_problems
from lippmann.job.fields.problem_words import expected_words, got_words

_ALTERNATIVES = frozenset({"bool", "int", "float", "str"})
_TYPE = re.compile(r"(literal|tuple|list|dict)\[.*\]|constrained-\w+", re.DOTALL)
MAX_TRANSLATED = 10 * MAX_PROBLEMS
"""The errors of pydantic that are translated; those after them are counted, since a sender may make any number."""
MAX_NAME = 100
"""The characters of an unknown field that are compared with the known ones, since a sender may write any number."""


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


def problems_of(error: ValidationError, model: type[BaseModel] | None = None) -> tuple[FieldProblem, ...]:
    """Translate pydantic's errors, except those of defaults that depend on an invalid field.

    Parameters
    ----------
    model
        The model that was validated, from whose fields the one is suggested that an unknown field may stand for.
    """
    errors = [item for item in error.errors(include_url=False) if item["type"] != "default_factory_not_called"]
    problems = [_problem(item, model) for item in _without_alternatives(errors[:MAX_TRANSLATED])]
    return first_problems(problems, more=len(errors[MAX_TRANSLATED:]))


def _without_alternatives(errors: Sequence[Any]) -> Iterator[Any]:
    """Yield one error for a value that fits none of several types, of which pydantic reports one error each."""
    by_value: dict[tuple[Any, ...], list[Any]] = {}
    for item in errors:
        by_value.setdefault(_above_alternative(item["loc"]), []).append(item)
    for place, items in by_value.items():
        alternatives = [item for item in items if _above_alternative(item["loc"]) == place != item["loc"]]
        inside = [item for item in alternatives if len(item["loc"]) > len(place) + 1]
        if not alternatives or inside:
            # One alternative has the shape of the value: its own errors say more than those of the others.
            yield from ({**item, "loc": (*place, *item["loc"][len(place) + 1 :])} for item in inside)
            yield from (item for item in items if item not in alternatives)
            continue
        words = list(dict.fromkeys(expected_words(item) for item in alternatives))
        expected = " or ".join(filter(None, (", ".join(words[:-1]), words[-1])))
        yield {"loc": place, "type": "alternatives", "msg": expected, "input": alternatives[0]["input"]}


def _above_alternative(place: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the location of a value whose alternatives pydantic names in the location of the error, such as `int`."""
    for index, part in enumerate(place):
        is_last = index == len(place) - 1
        is_type = _TYPE.fullmatch(part) if isinstance(part, str) else None
        if is_type or (is_last and part in _ALTERNATIVES):
            return place[:index]
    return place


def _problem(item: Any, model: type[BaseModel] | None) -> FieldProblem:
    place, kind, got = _place(without_tags(item["loc"])), item["type"], item["input"]
    cause = item.get("ctx", {}).get("error")
    if isinstance(cause, FieldError):
        return FieldProblem(field=".".join((*place, cause.field)), expected=cause.expected, got=cause.got)
    field = ".".join(place) or "(whole)"
    if kind == "extra_forbidden":
        name, known = str(item["loc"][-1])[:MAX_NAME], [] if model is None else _fields(model, item["loc"][:-1])
        hint = "".join(f" (did you mean {meant}?)" for meant in get_close_matches(name, known, n=1))
        return FieldProblem(field=field, expected=f"no field of this name{hint}", got=got_words(got))
    if kind == "missing":
        return FieldProblem(field=field, expected="a value", got="nothing")
    expected = expected_words(item)
    before, separator, after = expected.rpartition(", got ")
    return FieldProblem(field=field, expected=before or expected, got=after if separator else got_words(got))


def _fields(model: type[BaseModel], place: Iterable[Any]) -> list[str]:
    """Return the names of the fields that an object may have at a place in a model."""
    models = [model]
    for part in without_tags(place):
        if not part.isdecimal():
            models = [inner for one in models if part in one.model_fields
                      for inner in _models_in(one.model_fields[part].annotation)]  # fmt: skip
    return [name for one in models for name in one.model_fields]


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    """Return the models in an annotation such as `tuple[Model, ...] | None`."""
    annotation = getattr(annotation, "__value__", annotation)  # a type alias
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models_in(part)]


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
