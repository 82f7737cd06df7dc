"""The base of all models of a job: frozen, closed, and described by the docstrings of their fields."""

from __future__ import annotations

import ast
import inspect
import textwrap
from typing import Any

from annotated_types import Gt
from pydantic import BeforeValidator, ConfigDict, GetJsonSchemaHandler, ValidationInfo, field_validator
from pydantic_core import CoreSchema, PydanticKnownError

from lippmann.job.fields.json_types import JsonTyped
from lippmann.job.fields.labels import label_of, unit_of

LEAST = 1e-12
"""The least number of a job that must be positive, in whatever unit; lengths are in mm or um."""


class JobModel(JsonTyped):
    """A part of a job.

    The docstring below a field becomes the field's description in a JSON schema. It is read when a schema is made, not
    when the module is imported as by pydantic's `use_attribute_docstrings`, which doubles the import time of a command.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @field_validator("*")
    @classmethod
    def _check_not_tiny(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse almost nothing where a number must be positive: a quotient with it is infinite, or a product is 0."""
        if isinstance(value, float) and 0 < value < LEAST:
            limits = cls.model_fields[info.field_name or ""].metadata
            if any(isinstance(limit, Gt) and limit.gt == 0 for limit in limits):
                raise ValueError(f"a number of at least {LEAST:g}, got {value:g}")
        return value

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the JSON schema with the descriptions of the fields, their labels as `title`, and their `unit`."""
        schema = handler(core_schema)
        properties = handler.resolve_ref_schema(schema).get("properties", {})
        for name, about in properties.items():
            about["title"] = cls.model_fields[name].title or label_of(name)
            if unit_of(name):
                about["unit"] = unit_of(name)
        for name, text in _field_docstrings(cls).items():
            if name in properties:
                properties[name].setdefault("description", text)
        return schema


def at_most(count: int) -> BeforeValidator:
    """Refuse a list of more items before they are validated.

    `max_length` alone counts the valid items only, so that each item of a list of any length has errors of its own.
    """

    def check(value: object) -> object:
        if isinstance(value, list | tuple) and len(value) > count:
            sizes = {"field_type": "Tuple", "max_length": count, "actual_length": len(value)}
            raise PydanticKnownError("too_long", sizes)
        return value

    return BeforeValidator(check)


def _field_docstrings(model: type[JobModel]) -> dict[str, str]:
    """Return the docstrings of the fields of a model and of its bases, by name."""
    found: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if not issubclass(base, JobModel) or base is JobModel:
            continue
        (definition,) = ast.parse(textwrap.dedent(inspect.getsource(base))).body
        assert isinstance(definition, ast.ClassDef)  # noqa: S101 - the source of a class is its definition
        for field, below in zip(definition.body, definition.body[1:], strict=False):
            if not isinstance(field, ast.AnnAssign) or not isinstance(field.target, ast.Name):
                continue
            if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
                found[field.target.id] = inspect.cleandoc(str(below.value.value))
    return found
