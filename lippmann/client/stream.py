"""A parser of server-sent events (WHATWG HTML, section 9.2)."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class ServerEvent:
    """One event of the service."""

    type: str
    """`job`, `task`, `frame`, `progress` or `reset`."""
    data: Any
    id: str | None = None


def parse_events(lines: Iterable[str]) -> Iterator[ServerEvent]:
    """Yield the events in the lines of a stream; comments and events without data are skipped.

    >>> list(parse_events(["id: 7", "event: job", 'data: {"id": "a"}', "", ": alive"]))
    [ServerEvent(type='job', data={'id': 'a'}, id='7')]
    """
    kind, data, last_id = "message", list[str](), None
    for line in lines:
        if not line:
            if data:
                yield ServerEvent(type=kind, data=json.loads("\n".join(data)), id=last_id)
            kind, data = "message", []
            continue
        name, _, value = line.partition(":")
        value = value.removeprefix(" ")
        if name == "event":
            kind = value
        elif name == "data":
            data.append(value)
        elif name == "id":
            last_id = value
