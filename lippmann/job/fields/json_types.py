"""Values keep the types of JSON: `true` is not the number 1, and `"8"` is not the number 8.

pydantic converts such values by default. A job with `"slots": true` would run with one slot, although somebody meant
something else.
"""

from __future__ import annotations

from functools import cache
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ValidationInfo, field_validator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticKnownError

_PLAIN = frozenset({bool, int, float})
_Error = Literal["float_type", "int_type", "bool_type"]
_ERRORS: tuple[tuple[type, _Error], ...] = ((float, "float_type"), (int, "int_type"), (bool, "bool_type"))


class JsonTyped(BaseModel):
    """A model whose numbers and booleans are not taken from values of other JSON types."""

    @field_validator("*", mode="before")
    @classmethod
    def _check_json_type(cls, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, bool | int | str | list | tuple):
            allowed = _allowed(cls, info.field_name or "")
            if allowed and not (isinstance(value, str) and _is_sequence(cls, info.field_name or "")):
                _check(value, allowed)
        return value


def _check(value: Any, allowed: frozenset[type]) -> None:
    if isinstance(value, list | tuple):
        for item in value:
            _check(item, allowed)
    elif (isinstance(value, bool) and bool not in allowed) or (
        isinstance(value, str) or (type(value) is int and allowed == {bool})
    ):
        raise PydanticKnownError(next(error for kind, error in _ERRORS if kind in allowed))


@cache
def _allowed(model: type[BaseModel], name: str) -> frozenset[type]:
    """Return which of boolean, integer and number a field takes; nothing if it takes anything else, as texts."""
    found = frozenset(_leaves(model.model_fields[name])) - {type(None)}
    return found if found <= _PLAIN else frozenset()


@cache
def _is_sequence(model: type[BaseModel], name: str) -> bool:
    kind = model.model_fields[name].annotation
    return bool({get_origin(one) for one in (kind, *get_args(kind))} & {list, tuple})


def _leaves(kind: FieldInfo | Any) -> list[Any]:
    if isinstance(kind, FieldInfo):
        return _leaves(kind.annotation)
    inner = [one for one in get_args(kind) if one is not Ellipsis]
    if hasattr(kind, "__metadata__"):  # Annotated: the rest of its arguments are no types
        return _leaves(kind.__origin__)
    return [leaf for one in inner for leaf in _leaves(one)] if inner else [kind]
