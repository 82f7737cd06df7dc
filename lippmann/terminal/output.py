"""The output of a command: its result on stdout, as JSON or as text, and its notes on stderr."""

from __future__ import annotations

import io
import json
import re
import sys
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

_CONTROL = re.compile("[\0-\x08\x0b-\x1f\x7f-\x9f]")
_NOT_PLAIN = re.compile("[\x7f-\x9f\ud800-\udfff]")


@dataclass(frozen=True)
class Output:
    """The output of one command."""

    as_json: bool

    def result(self, data: Any, text: str) -> None:
        """Print the result to stdout: `data` as JSON for programs, or `text` for people."""
        print(json_text(data) if self.as_json else shown(text), flush=True)

    def note(self, text: str) -> None:
        """Print a note to stderr; the work goes on where nobody can read it, as on a terminal that was closed."""
        with suppress(OSError):
            print(shown(text), file=sys.stderr, flush=True)


def shown(text: str) -> str:
    r"""Return a text without control characters, but for line ends and tabs: a scene or a title may have any.

    A terminal obeys them: they move the cursor over what was printed before, or rename the window.

    >>> shown("a\x1b[31m\r\nb")
    'a\\x1b[31m\nb'
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n")
    return _CONTROL.sub(lambda found: f"\\x{ord(found[0]):02x}", lines)


def json_text(data: Any) -> str:
    r"""Return data as JSON that is valid UTF-8.

    A path that is not UTF-8 holds lone surrogates in Python (PEP 383). They are written as JSON escapes, and
    `os.fsencode` of what Python's JSON reader makes of them gives the bytes of the path. So are all control characters.

    >>> print(json_text({"file": "caf\udce9.png", "title": "é"}))
    {"file": "caf\udce9.png", "title": "é"}
    """
    return _NOT_PLAIN.sub(lambda found: f"\\u{ord(found[0]):04x}", json.dumps(data, ensure_ascii=False))


def print_any_path() -> None:
    """Let stdout print paths that are not UTF-8 byte for byte, and let stderr escape them."""
    for stream, errors in ((sys.stdout, "surrogateescape"), (sys.stderr, "backslashreplace")):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=errors)
