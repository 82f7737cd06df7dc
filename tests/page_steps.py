"""The steps of a page of the documentation: files to write, and lines to type."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

_BLOCK = re.compile(r"```([a-z]+)\n(.*?)```", re.DOTALL)


@dataclass(frozen=True)
class Steps:
    """The steps of a page."""

    files: dict[str, str]
    """The text of each file by its path: a block of code after a text that names a file with that ending."""
    commands: tuple[str, ...]
    """The blocks of lines for a shell."""

    def write_files(self, folder: Path) -> None:
        for name, text in self.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8")


def steps_of(text: str) -> Steps:
    """Return the steps of a page in Markdown."""
    files, commands, end = dict[str, str](), list[str](), 0
    for block in _BLOCK.finditer(text):
        kind, body = block.groups()
        if kind == "sh":
            commands.append(body)
        elif named := re.findall(rf"`([\w./-]+\.{kind})`", text[end : block.start()]):
            files[named[-1]] = body
        end = block.end()
    return Steps(files, tuple(commands))
