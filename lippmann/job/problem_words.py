"""The words for what a field must be, by the kind of pydantic's error: those of whoever writes a job file, in JSON."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from lippmann.untrusted.shown import shown

_WORDS = MappingProxyType(
    {
        "bool_parsing": "true or false",
        "bool_type": "true or false",
        "dict_type": "an object",
        "finite_number": "a finite number",
        "float_parsing": "a number",
        "float_type": "a number",
        "int_from_float": "a whole number",
        "int_parsing": "a whole number",
        "int_parsing_size": "a smaller whole number",
        "int_type": "a whole number",
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
    """
    context = item.get("ctx", {})
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


def got_words(value: object) -> str:
    """Return a value as JSON writes it, cut short.

    >>> got_words(None), got_words(True), got_words(1), got_words("a")
    ('null', 'true', '1', "'a'")
    """
    return _JSON.get(id(value)) or shown(value)
