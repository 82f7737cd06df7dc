"""The output of a command: its result on stdout, as JSON or as text, and its notes on stderr."""

from __future__ import annotations

import io
import json
import re
import sys
from dataclasses import dataclass
from typing import Any

_SURROGATE = re.compile("[\ud800-\udfff]")


@dataclass(frozen=True)
class Output:
    """The output of one command."""

    as_json: bool

    def result(self, data: Any, text: str) -> None:
        """Print the result to stdout: `data` as JSON for programs, or `text` for people."""
        print(json_text(data) if self.as_json else text, flush=True)

    def note(self, text: str) -> None:
        """Print a note to stderr."""
        print(text, file=sys.stderr, flush=True)


def json_text(data: Any) -> str:
    r"""Return data as JSON that is valid UTF-8.

    A path that is not UTF-8 holds lone surrogates in Python (PEP 383). They are written as JSON escapes, and
    `os.fsencode` of what Python's JSON reader makes of them gives the bytes of the path.

    >>> print(json_text({"file": "caf\udce9.png", "title": "é"}))
    {"file": "caf\udce9.png", "title": "é"}
    """
    return _SURROGATE.sub(lambda found: f"\\u{ord(found[0]):04x}", json.dumps(data, ensure_ascii=False))


def print_any_path() -> None:
    """Let stdout print paths that are not UTF-8 byte for byte, and let stderr escape them."""
    for stream, errors in ((sys.stdout, "surrogateescape"), (sys.stderr, "backslashreplace")):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=errors)
