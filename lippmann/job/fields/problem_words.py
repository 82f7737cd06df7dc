"""The words for what a field must be, by the kind of pydantic's error: those of whoever writes a job file, in JSON."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from lippmann.untrusted.shown import shown

if TYPE_CHECKING:
    from pydantic import ValidationError

_WORDS = MappingProxyType(
    {
        "bool_parsing": "true or false",
        "bool_type": "true or false",
        "dict_type": "an object",
        "finite_number": "a finite number",
        "float_parsing": "a number",
        "float_type": "a number",
        "greater_than": "a number above {gt}",
        "greater_than_equal": "a number of at least {ge}",
        "int_from_float": "a whole number",
        "int_parsing": "a whole number",
        "int_parsing_size": "a smaller whole number",
        "int_type": "a whole number",
        "less_than": "a number below {lt}",
        "less_than_equal": "a number of at most {le}",
        "json_invalid": "JSON",
        "list_type": "a list",
        "mapping_type": "an object",
        "missing": "a value",
        "model_attributes_type": "an object",
        "model_type": "an object",
        "none_required": "null",
        "string_pattern_mismatch": "text that matches {pattern}",
        "string_too_long": "text of at most {max_length} characters",
        "string_too_short": "text of at least {min_length} characters",
        "string_type": "text",
        "string_unicode": "text in UTF-8",
        "too_long": "a list of at most {max_length} items",
        "too_short": "a list of at least {min_length} items",
        "tuple_type": "a list",
    }
)
_PATTERNS = MappingProxyType(
    {
        r"^[a-z0-9][a-z0-9-]*$": "lower-case letters, digits and dashes, with a letter or digit first",
        r"^[A-Za-z0-9][A-Za-z0-9-]*$": "letters, digits and dashes, with a letter or digit first",
        r"^[a-z0-9][a-z0-9_-]*$": "lower-case letters, digits, dashes and underscores, with a letter or digit first",
    }
)
_JSON = MappingProxyType({id(None): "null", id(True): "true", id(False): "false"})


def expected_words(item: Mapping[str, Any]) -> str:
    """Return what was expected, from an error of pydantic.

    >>> expected_words({"type": "string_too_short", "msg": "String should ...", "ctx": {"min_length": 1}})
    'text of at least 1 character'
    >>> expected_words({"type": "greater_than_equal", "msg": "Input should ...", "ctx": {"ge": 1e-6}})
    'a number of at least 0.000001'
    """
    context: dict[str, Any] = {name: _plain(value) for name, value in item.get("ctx", {}).items()}
    pattern = _PATTERNS.get(context.get("pattern", ""))
    if pattern is not None:
        return pattern
    words = _WORDS.get(item["type"])
    if words is not None:
        return words.format(**context).replace(" 1 characters", " 1 character").replace(" 1 items", " 1 item")
    text = str(item["msg"]).removeprefix("Value error, ")
    for prefix in ("Input should be ", "Value should be "):
        text = text.removeprefix(prefix)
    return text


def first_problem(error: ValidationError) -> str:
    """Return the first problem of an error of pydantic, such as `pitch_mm: expected a number above 0, got -1`."""
    item: Any = error.errors()[0]
    field = ".".join(map(str, item["loc"])) or "(whole)"
    return f"{field}: expected {expected_words(item)}, got {got_words(item['input'])}"


def _plain(value: object) -> object:
    """Return a limit without an exponent, as people write it."""
    return f"{Decimal(str(value)).normalize():f}" if isinstance(value, int | float) else value


def got_words(value: object) -> str:
    """Return a value as JSON writes it, cut short.

    >>> got_words(None), got_words(True), got_words(1), got_words("a")
    ('null', 'true', '1', "'a'")
    """
    return _JSON.get(id(value)) or shown(value)
