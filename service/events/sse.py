"""The text of server-sent events (WHATWG HTML, section 9.2)."""

from __future__ import annotations


def encode(identifier: int, topic: str, data: str) -> bytes:
    r"""Return one server-sent event; its data is JSON without line breaks.

    >>> encode(7, "frame", '{"frame": 1}')
    b'id: 7\nevent: frame\ndata: {"frame": 1}\n\n'
    """
    return f"id: {identifier}\nevent: {topic}\ndata: {data}\n\n".encode()


def comment(text: str, *, identifier: int | None = None) -> bytes:
    r"""Return a comment, which clients skip; with an id, clients that come back continue after it.

    >>> comment("here", identifier=7)
    b'id: 7\n: here\n\n'
    """
    position = "" if identifier is None else f"id: {identifier}\n"
    return f"{position}: {text}\n\n".encode()


ALIVE = comment("alive")
