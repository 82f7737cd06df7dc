"""The description of the API as the sections of a page.

A type is shown as text with links to the shapes that it names. Descriptions are plain text with `code` in backticks.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup, escape

_OR, _COMMA = Markup(" or "), Markup(", ")
_LIMITS = (
    ("minimum", "at least {}"),
    ("exclusiveMinimum", "more than {}"),
    ("maximum", "at most {}"),
    ("exclusiveMaximum", "less than {}"),
    ("minLength", "at least {} characters"),
    ("maxLength", "at most {} characters"),
    ("minItems", "at least {} items"),
    ("maxItems", "at most {} items"),
    ("pattern", "matches {}"),
    ("default", "default {}"),
)
"""The keywords that limit a value, and how the page says them."""


@dataclass(frozen=True)
class Row:
    """One parameter or one field."""

    name: str
    type: Markup
    note: str
    """The place of a parameter in the request, and `required` if there is no default."""
    text: Markup


@dataclass(frozen=True)
class Outcome:
    """One response of an operation."""

    status: str
    type: Markup
    text: Markup


@dataclass(frozen=True)
class Operation:
    """One method of one path."""

    anchor: str
    method: str
    path: str
    title: str
    text: Markup
    needs_key: bool
    parameters: tuple[Row, ...]
    body: Markup
    outcomes: tuple[Outcome, ...]


@dataclass(frozen=True)
class Shape:
    """One schema that the operations name."""

    name: str
    text: Markup
    type: Markup
    fields: tuple[Row, ...]


@dataclass(frozen=True)
class Reference:
    """The whole page."""

    groups: Mapping[str, tuple[Operation, ...]]
    """The operations by their tag."""
    messages: tuple[Operation, ...]
    """The messages of the farm to the receiver of a webhook."""
    shapes: tuple[Shape, ...]


def reference_of(described: Mapping[str, Any]) -> Reference:
    """Return an OpenAPI description as the sections of a page."""
    groups = dict[str, tuple[Operation, ...]]()
    for path, methods in described["paths"].items():
        for method, operation in methods.items():
            tag = str(operation["tags"][0])
            groups[tag] = (*groups.get(tag, ()), _operation(described, method.upper(), path, operation))
    messages = tuple(
        _operation(described, method.upper(), name, operation)
        for name, methods in described.get("webhooks", {}).items()
        for method, operation in methods.items()
    )
    schemas = sorted(described["components"]["schemas"].items())
    return Reference(groups, messages, tuple(_shape(name, schema) for name, schema in schemas))


def type_text(schema: Mapping[str, Any]) -> Markup:
    """Return a type as text.

    Examples
    --------
    >>> type_text({"type": "array", "items": {"$ref": "#/components/schemas/Job"}})
    Markup('list of <a href="#Job">Job</a>')
    >>> type_text({"anyOf": [{"type": "integer", "minimum": 1}, {"type": "null"}]})
    Markup('integer (at least 1) or null')
    """
    notes = [how.format(_value(schema[key])) for key, how in _LIMITS if key in schema]
    limits = Markup(" ({})").format(", ".join(notes)) if notes else Markup()
    return _bare_type(schema) + limits


def prose(text: str) -> Markup:
    """Return a description as paragraphs.

    Examples
    --------
    >>> prose("Send `key`.")
    Markup('<p>Send <code>key</code>.</p>')
    """
    return Markup().join(_paragraph(part) for part in re.split(r"\n\s*\n", text.strip()) if part)


def _bare_type(schema: Mapping[str, Any]) -> Markup:
    if "$ref" in schema:
        return Markup('<a href="#{0}">{0}</a>').format(_last(schema["$ref"]))
    if "const" in schema or "enum" in schema:
        values = schema["enum"] if "enum" in schema else [schema["const"]]
        return _OR.join(_code(_value(value)) for value in values)
    for key in ("anyOf", "oneOf", "allOf"):
        if key in schema:
            return _joined(map(type_text, schema[key]))
    kind = schema.get("type", "any value")
    if kind == "array" and "prefixItems" in schema:
        return Markup("[{}]").format(_COMMA.join(map(type_text, schema["prefixItems"])))
    if kind == "array":
        return Markup("list of {}").format(type_text(schema.get("items", {})))
    if kind == "object" and isinstance(schema.get("additionalProperties"), Mapping):
        return Markup("object of {}").format(type_text(schema["additionalProperties"]))
    if kind == "object" and "properties" in schema:
        return Markup("object with {}").format(_joined(map(_named, schema["properties"].items()), _COMMA))
    return escape(schema.get("format", kind))


def _named(item: tuple[str, Mapping[str, Any]]) -> Markup:
    name, schema = item
    return Markup("{}: {}").format(_code(name), type_text(schema))


def _operation(described: Mapping[str, Any], method: str, path: str, operation: Mapping[str, Any]) -> Operation:
    content = operation.get("requestBody", {}).get("content", {})
    return Operation(
        anchor=operation["operationId"],
        method=method,
        path=path,
        title=operation["summary"].capitalize(),
        text=prose(operation.get("description", "")),
        needs_key="security" in operation,
        parameters=tuple(map(_parameter, operation.get("parameters", ()))),
        body=_joined(_contents(content)),
        outcomes=tuple(_outcome(described, status, one) for status, one in sorted(operation["responses"].items())),
    )


def _parameter(parameter: Mapping[str, Any]) -> Row:
    note = f"{parameter['in']}, required" if parameter.get("required") else str(parameter["in"])
    text = prose(parameter.get("description", parameter["schema"].get("description", "")))
    return Row(parameter["name"], type_text(parameter["schema"]), note, text)


def _outcome(described: Mapping[str, Any], status: str, response: Mapping[str, Any]) -> Outcome:
    if "$ref" in response:
        response = described["components"]["responses"][_last(response["$ref"])]
    said = response["description"]
    return Outcome(status, _joined(_contents(response.get("content", {}))), _inline(_SUCCESS.get(said, said)))


_SUCCESS = {"Successful Response": "The request succeeded."}


def _contents(content: Mapping[str, Any]) -> Iterator[Markup]:
    for media_type, one in content.items():
        shown = type_text(one["schema"]) if one.get("schema") else Markup()
        yield Markup("{} {}").format(_code(media_type), shown)


def _shape(name: str, schema: Mapping[str, Any]) -> Shape:
    required = schema.get("required", ())
    fields = tuple(
        Row(field, type_text(one), "required" if field in required else "", prose(one.get("description", "")))
        for field, one in schema.get("properties", {}).items()
    )
    return Shape(name, prose(schema.get("description", "")), Markup() if fields else type_text(schema), fields)


def _joined(parts: Iterable[Markup], between: Markup = _OR) -> Markup:
    return between.join(dict.fromkeys(parts))


def _paragraph(text: str) -> Markup:
    return Markup("<p>{}</p>").format(_inline(text))


def _inline(text: str) -> Markup:
    return Markup().join(_code(part) if at % 2 else escape(part) for at, part in enumerate(text.split("`")))


def _code(text: str) -> Markup:
    return Markup("<code>{}</code>").format(text)


def _value(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)


def _last(reference: str) -> str:
    return reference.rpartition("/")[2]
