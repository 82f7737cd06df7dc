"""The ids and names that are parts of the addresses of requests."""

from __future__ import annotations

import re

from lippmann.errors import BadInput

_PLAIN = re.compile(r"(?!\.+$)[\w.-]{1,200}")


def plain_name(name: str) -> str:
    """Return an id or a name that is one part of a path; the service would read another one as another request.

    >>> plain_name("01k-3")
    '01k-3'

    Raises
    ------
    BadInput
        If the text is not one part of a path.
    """
    if not _PLAIN.fullmatch(name):
        raise BadInput(f"expected an id or a name of letters, digits, dots and dashes, got {name[:100]!r}")
    return name
