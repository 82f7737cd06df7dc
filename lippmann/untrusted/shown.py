"""Values from strangers in messages: the beginning of their text, in time that does not depend on their size."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

MAX_SHOWN = 120
"""The greatest length of a value in a message."""
_MAX_BITS = 1024


def shown(value: Any, *, length: int = MAX_SHOWN) -> str:
    """Return the `repr` of a value, cut to a length.

    >>> shown({"scene": "fish"})
    "{'scene': 'fish'}"
    >>> shown([0] * 10**6, length=12)
    '[0, 0, 0,...'
    """
    text = ""
    for piece in _pieces(value, length):
        text += piece
        if len(text) > length:
            return text[: length - 3] + "..."
    return text


def _pieces(value: Any, length: int) -> Iterator[str]:
    """Yield the text of a value piece by piece; every level yields a character, which bounds the recursion."""
    kind = type(value)
    if kind in (str, bytes):
        yield repr(value[: length + 1])
    elif kind is int and value.bit_length() > _MAX_BITS:
        yield f"a number of {value.bit_length()} bits"
    elif kind is list or (kind is tuple and len(value) > 1):
        yield "[" if kind is list else "("
        for place, item in enumerate(value):
            yield ", " if place else ""
            yield from _pieces(item, length)
        yield "]" if kind is list else ")"
    elif isinstance(value, Mapping) and kind is dict:
        yield "{"
        for place, (name, item) in enumerate(value.items()):
            yield ", " if place else ""
            yield from _pieces(name, length)
            yield ": "
            yield from _pieces(item, length)
        yield "}"
    else:
        yield repr(value)
