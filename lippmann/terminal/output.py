"""What a command says: JSON for programs on stdout, text for people; notes always on stderr."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Talk:
    """How one command speaks."""

    as_json: bool

    def result(self, data: Any, text: str) -> None:
        """Say what came out: `data` to a program, `text` to a person."""
        print(json.dumps(data, ensure_ascii=False) if self.as_json else text, flush=True)

    def note(self, text: str) -> None:
        """Say something on the way."""
        print(text, file=sys.stderr, flush=True)
